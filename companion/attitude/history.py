"""Where a plan stood a while ago, and where it goes on to."""

from bisect import bisect_right
from typing import NamedTuple

_TRIMMED = 64
"""Rows that no delay reaches any more are dropped by so many at once."""


class Planned(NamedTuple):
    """The plan at one time.

    Attributes:
        north, east: coefficients.
        heading: rad, not wrapped.
        still: integral of R_z, the yaw rate that kept the heading still on the way, rad.
        turned: integral of the yaw rate with which the body answers what it was sent, rad.
        turning: that yaw rate, rad/s.
    """

    north: float
    east: float
    heading: float
    still: float
    turned: float
    turning: float


class History:
    """What was planned, over the longest delay that is asked for.

    Args:
        span: that delay, s.
    """

    __slots__ = ("_rows", "_span", "_times")

    def __init__(self, span: float) -> None:
        self._span = span
        self._times: list[float] = []
        self._rows: list[Planned] = []

    def start(self, time: float, row: Planned, motion: Planned) -> None:
        """Forget all; up to `row` the plan moved evenly, by `motion` a second."""
        earlier = Planned(*(a - self._span * b for a, b in zip(row, motion, strict=True)))
        self._times[:] = [time - self._span, time]
        self._rows[:] = [earlier, row]

    def add(self, time: float, row: Planned) -> None:
        """A newer row; rows that no delay reaches are dropped."""
        times = self._times
        times.append(time)
        self._rows.append(row)
        if len(times) > _TRIMMED and times[_TRIMMED] < time - self._span:
            del times[:_TRIMMED], self._rows[:_TRIMMED]

    @property
    def newest(self) -> Planned:
        """The plan as it was last added."""
        return self._rows[-1]

    def at(self, time: float) -> Planned:
        """The plan at `time`: linear between rows and beyond them."""
        a, b, share = self._around(time)
        north, east, heading, still, turned, turning = a
        return Planned(
            north + share * (b[0] - north),
            east + share * (b[1] - east),
            heading + share * (b[2] - heading),
            still + share * (b[3] - still),
            turned + share * (b[4] - turned),
            turning + share * (b[5] - turning),
        )

    def turned_at(self, time: float) -> float:
        """`turned` of the plan at `time`, as `at`, rad."""
        a, b, share = self._around(time)
        return a.turned + share * (b.turned - a.turned)

    def _around(self, time: float) -> tuple[Planned, Planned, float]:
        """The rows before and after `time`, and how far it is from the one to the other."""
        times = self._times
        later = min(max(bisect_right(times, time), 1), len(times) - 1)
        start = times[later - 1]
        return self._rows[later - 1], self._rows[later], (time - start) / (times[later] - start)
