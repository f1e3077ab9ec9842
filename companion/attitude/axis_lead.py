"""Lead of one axis, roll or pitch: the rate to send so that the axis turns as planned."""

from math import cos, sin

from companion.attitude.history import PlanHistory
from companion.attitude.kinematics import into_body
from companion.attitude.rate_response import AxisResponse

ROLL, PITCH = 0, 1


class AxisLead:
    """Leads the planned rate of one axis by that axis's own lag: ω + τ·ω̇ + σ·ω̈.

    The axis with the shorter dead time waits, so that the plan acts on both axes at once.

    Args:
        index: `ROLL` or `PITCH`.
        axis: its response.
        wait: by how much its dead time is shorter than that of the other axis, s.
        plans: of tilt and heading.
    """

    __slots__ = ("_index", "_lag", "_plan", "_plans", "_square", "_turn", "_wait")

    def __init__(self, index: int, axis: AxisResponse, wait: float, plans: PlanHistory) -> None:
        self._index = index
        self._lag, self._square = axis.lag, axis.square
        self._wait = wait
        self._plans = plans

    def advance(self) -> None:
        """Go on to the plan that acts when the newest plan acts on the slower axis."""
        plans = self._plans
        planned_for = plans.time - self._wait
        self._plan = plans.tilt.at(planned_for) if self._wait else plans.tilt.newest
        self._turn = plans.turn_when(planned_for, self._plan)

    def command(self, dt: float, heading: float) -> float:
        """The rate to send for the sample of `dt` seconds that ends with the newest plan, rad/s.

        The plan is turned into the body at each end of the sample, by the heading predicted for it.

        Args:
            dt: s.
            heading: the base of the turns, rad.
        """
        rate, slope = self._seen(heading)
        self.advance()
        rate_then, slope_then = self._seen(heading)
        return (
            0.5 * (rate + rate_then)
            + self._lag / dt * (rate_then - rate)
            + self._square / dt * (slope_then - slope)
        )

    def _seen(self, base: float) -> tuple[float, float]:
        """The planned rate about our axis of the body, rad/s, and its slope, rad/s²."""
        plan, heading = self._plan, base + self._turn.angle
        cosine, sine = cos(heading), sin(heading)
        roll, pitch = into_body(cosine, sine, plan.x, plan.y)
        roll_slope, pitch_slope = into_body(cosine, sine, plan.x_slope, plan.y_slope)
        if self._index == ROLL:
            return roll, roll_slope + self._turn.rate * pitch
        return pitch, pitch_slope - self._turn.rate * roll
