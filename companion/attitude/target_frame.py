"""The axes along which ArduPilot takes body rates: those of its attitude target.

Rates turn the target at once, but for their slew limit, and the body follows it, in yaw a fifth of
a second later. ATTITUDE_TARGET says where these axes stand; they turn on by the rates sent since.
"""

from bisect import bisect_right
from math import inf

from companion.attitude.rate_response import RateResponse
from companion.attitude.rotation import within

OLDEST = 0.25
"""Told longer ago than this, s, the target's attitude is not used any more."""

_BEHIND_TARGET = 0.008
"""Of the dead time of roll and pitch, this part lies between target and body, s (measured)."""

_TRIMMED = 128
"""Rows that are too old are dropped by so many at once."""


class TargetFrame:
    """The heading of these axes, carried on from when it was told.

    Args:
        response: of the vehicle's rate loop.
    """

    __slots__ = (
        "_acceleration",
        "_aim",
        "_delay",
        "_offset",
        "_time",
        "_times",
        "_told_at",
        "_ways",
    )

    def __init__(self, response: RateResponse) -> None:
        self._acceleration = response.yaw.acceleration
        self._delay = max(0.0, response.tilt.dead_time - _BEHIND_TARGET)
        self._times: list[float] = []
        self._ways: list[float] = []
        self.forget()

    def forget(self) -> None:
        """Where these axes stand is not known."""
        self._time, self._told_at = 0.0, -inf
        self._offset = self._aim = 0.0
        self._times[:], self._ways[:] = [0.0], [0.0]

    def note(self, heading: float, age: float) -> None:
        """They had this heading (rad) so long ago, s, by the time of the newest sample."""
        if not 0.0 <= age <= OLDEST:
            return
        self._told_at = self._time - age
        self._offset = heading - self._way(self._told_at - self._delay)

    def advance(self, yaw: float, still: float, dt: float) -> None:
        """The yaw rate is sent for `dt` seconds; `still` of it keeps the heading (rad/s)."""
        if self._told_at == -inf:
            return  # the body's own axes, as far as is known
        self._aim += within(yaw - self._aim, self._acceleration * dt)
        self._time += dt
        times = self._times
        times.append(self._time)
        self._ways.append(self._ways[-1] + (self._aim - still) * dt)
        if len(times) > _TRIMMED and times[_TRIMMED] < self._time - OLDEST - self._delay:
            del times[:_TRIMMED], self._ways[:_TRIMMED]

    def heading(self) -> float | None:
        """Their heading when what is answered now turns them, rad; None: it is not known."""
        if self._time - self._told_at > OLDEST:
            return None
        return self._offset + self._ways[-1]

    def _way(self, time: float) -> float:
        """How far what was sent until `time` turns them, rad: linear between samples."""
        times, ways = self._times, self._ways
        later = bisect_right(times, time)
        if later == 0:
            return ways[0]
        if later == len(times):
            return ways[-1]
        start = times[later - 1]
        share = (time - start) / (times[later] - start)
        return ways[later - 1] + share * (ways[later] - ways[later - 1])
