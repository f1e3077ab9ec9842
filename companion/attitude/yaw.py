"""Yaw in `model-following`: the planned heading, the predicted turn of the body, the axes."""

from math import inf, radians

from companion.attitude.history import PlanHistory, between
from companion.attitude.limits import Constants
from companion.attitude.rate_response import AxisResponse, RateResponse
from companion.attitude.reference import first_order_step
from companion.attitude.representation import wrap_angle
from companion.attitude.rotation import clamp
from companion.attitude.types import Target


class HeadingModel:
    """ψ̈ = (v − ψ̇)/τ with v = k·(ψ_d − ψ) + ψ̇_d; v has a limit and a slew limit.

    Args:
        constants: gains and limits.
        yaw: the vehicle's response; τ is its lag.

    Attributes:
        heading: rad, not wrapped.
        turn_rate: its speed, rad/s.
    """

    __slots__ = ("_acceleration", "_fastest", "_gain", "_lag", "_v", "heading", "turn_rate")

    def __init__(self, constants: Constants, yaw: AxisResponse) -> None:
        self._gain = constants.yaw_gain
        self._lag = yaw.lag
        self._acceleration = yaw.acceleration
        # Near the target v falls by k·v a second.
        self._fastest = constants.max_yaw_rate
        if self._gain > 0.0:
            self._fastest = min(self._fastest, yaw.acceleration / self._gain)
        self.place(0.0, 0.0)

    def place(self, heading: float, turn_rate: float) -> None:
        """Start at this heading (rad), turning at this rate (rad/s)."""
        self.heading = heading
        self.turn_rate = self._v = turn_rate

    def advance(self, target: Target, dt: float) -> None:
        """Move on by `dt` seconds towards an admissible target."""
        wanted = self._gain * wrap_angle(target.heading - self.heading) + target.heading_rate
        change = clamp(wanted, self._fastest) - self._v
        v = self._v = self._v + clamp(change, self._acceleration * dt)
        moved, self.turn_rate = first_order_step(self.turn_rate, v, self._lag, dt)
        self.heading += moved


class YawModel:
    """Response of the yaw axis without its dead time: slew limit, then lag.

    Attributes:
        rate: rad/s.
        turned: its integral, rad.

    Args:
        response: of yaw.
    """

    __slots__ = ("_acceleration", "_aimed", "_lag", "rate", "turned")

    def __init__(self, response: AxisResponse) -> None:
        self._lag = response.lag
        self._acceleration = response.acceleration
        self.start(0.0)

    def start(self, rate: float) -> None:
        """Turn steadily at `rate` rad/s, and count from here."""
        self.rate = self._aimed = rate
        self.turned = 0.0

    def advance(self, command: float, dt: float) -> None:
        """Hold the yaw rate `command` (rad/s) for `dt` seconds."""
        before, most = self._aimed, self._acceleration * dt
        aimed = self._aimed = before + clamp(command - before, most) if most < inf else command
        # Uses the aim at the end of the sample: at most half a sample early.
        moved, self.rate = first_order_step(self.rate, aimed, self._lag, dt)
        self.turned += moved


LARGEST_LEAD = radians(45.0)
"""ArduPilot does not let its attitude target lead the body in yaw by more."""

OLDEST = 0.25
"""An attitude target older than this is not used, s."""

_BEHIND_TARGET = 0.008
"""Part of the dead time of roll and pitch between attitude target and body, s (measured)."""

_TRIMMED = 128
"""Rows that are too old are dropped in blocks of this many."""


class TargetFrame:
    """Heading of the axes along which ArduPilot takes body rates: those of its attitude target.

    Rates turn the target at once, but for its slew limit; the body follows, in yaw a fifth of a
    second later. ATTITUDE_TARGET tells the heading; it turns on by the rates sent since.

    Args:
        response: of the vehicle's rate loop.
    """

    __slots__ = (
        "_acceleration",
        "_aim",
        "_delay",
        "_lead",
        "_offset",
        "_time",
        "_times",
        "_told_at",
        "_ways",
    )

    def __init__(self, response: RateResponse) -> None:
        self._acceleration = response.yaw.acceleration
        self._lead = response.lead
        self._delay = max(0.0, response.tilt.dead_time - _BEHIND_TARGET)
        self._times: list[float] = []
        self._ways: list[float] = []
        self.forget()

    def forget(self) -> None:
        """Forget the heading of these axes."""
        self._time, self._told_at = 0.0, -inf
        self._offset = self._aim = 0.0
        self._times[:], self._ways[:] = [0.0], [0.0]

    def note(self, heading: float, age: float) -> None:
        """Take their heading (rad) `age` seconds before the newest sample."""
        if not 0.0 <= age <= OLDEST:
            return
        self._told_at = self._time - age
        self._offset = heading - self._way(self._told_at - self._delay)

    def advance(self, yaw: float, still: float, dt: float) -> None:
        """The yaw rate is sent for `dt` seconds; `still` of it keeps the heading (rad/s)."""
        if self._told_at == -inf:
            return  # no attitude target was received: the rates are along the body's axes
        self._aim += clamp(yaw - self._aim, self._acceleration * dt)
        self._time += dt
        times = self._times
        times.append(self._time)
        self._ways.append(self._ways[-1] + (self._aim - still) * dt)
        if len(times) > _TRIMMED and times[_TRIMMED] < self._time - OLDEST - self._delay:
            del times[:_TRIMMED], self._ways[:_TRIMMED]

    def lead(self, heading: float, plans: PlanHistory) -> float:
        """How far these axes lead the body in yaw when the answer to this sample acts, rad.

        From the newest attitude target; without one, from their lead in time (`RateResponse.lead`).

        Args:
            heading: of the body then, without the turn that is planned until then, rad.
            plans: of tilt and heading.
        """
        told = self.heading()
        if told is not None:
            turn = plans.turn_when(plans.time, plans.tilt.newest)
            lead = wrap_angle(told - heading - turn.angle)
            if abs(lead) <= LARGEST_LEAD:
                return lead
        return 0.0 if self._lead == 0.0 else plans.turn_within(self._lead)

    def heading(self) -> float | None:
        """Their heading when the answer to this sample acts, rad; None: it is not known."""
        if self._time - self._told_at > OLDEST:
            return None
        return self._offset + self._ways[-1]

    def _way(self, time: float) -> float:
        """How far the rates sent until `time` turn them, rad: linear between samples."""
        times, ways = self._times, self._ways
        if time < times[0]:
            return ways[0]
        if time >= times[-1]:
            return ways[-1]
        later, share = between(times, time)
        return ways[later - 1] + share * (ways[later] - ways[later - 1])
