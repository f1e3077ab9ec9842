"""Lag compensation of roll or pitch: computes the rate command for the planned motion."""

from math import cos, sin

from companion.attitude.history import PlanHistory
from companion.attitude.kinematics import rotate_to_heading
from companion.attitude.rate_response import AxisResponse

ROLL, PITCH = 0, 1


class AxisLead:
    """Compensates the lag of one axis: commands ω + τ·ω̇ + σ·ω̈ for a planned rate ω.

    τ and σ are `lag` and `sigma` of the `AxisResponse`. The axis with the shorter dead time follows
    older plans, so that a plan takes effect on both axes at the same time.

    Args:
        index: `ROLL` or `PITCH`.
        axis: response of this axis.
        plan_delay: larger dead time of roll and pitch minus that of this axis, s.
        plans: plans of tilt and heading.
    """

    __slots__ = ("_heading_change", "_index", "_lag", "_plan", "_plan_delay", "_plans", "_sigma")

    def __init__(
        self, index: int, axis: AxisResponse, plan_delay: float, plans: PlanHistory
    ) -> None:
        self._index = index
        self._lag, self._sigma = axis.lag, axis.sigma
        self._plan_delay = plan_delay
        self._plans = plans

    def advance(self) -> None:
        """Move on to the plan made for `plan_delay` seconds before the time of the newest plan."""
        plans = self._plans
        planned_for = plans.time - self._plan_delay
        self._plan = plans.tilt.at(planned_for) if self._plan_delay else plans.tilt.newest
        self._heading_change = plans.predicted_heading_change(planned_for, self._plan)

    def command(self, dt: float, start_heading: float) -> float:
        """Return the rate to send from this plan to the next one, rad/s; advance to the next plan.

        Both plans are rotated into the body axes predicted for the times of the plans.

        Args:
            dt: time from the last plan to the next one, s.
            start_heading: see `FeedForward.advance`.
        """
        rate, slope = self._planned_rate(start_heading)
        self.advance()
        next_rate, next_slope = self._planned_rate(start_heading)
        return (
            0.5 * (rate + next_rate)
            + self._lag / dt * (next_rate - rate)
            + self._sigma / dt * (next_slope - slope)
        )

    def _planned_rate(self, start_heading: float) -> tuple[float, float]:
        """The planned rate about this body axis, rad/s, and the derivative of that rate, rad/s²."""
        plan, heading = self._plan, start_heading + self._heading_change.angle
        cosine, sine = cos(heading), sin(heading)
        roll, pitch = rotate_to_heading(cosine, sine, plan.x_rate, plan.y_rate)
        roll_slope, pitch_slope = rotate_to_heading(cosine, sine, plan.x_slope, plan.y_slope)
        if self._index == ROLL:
            return roll, roll_slope + self._heading_change.rate * pitch
        return pitch, pitch_slope - self._heading_change.rate * roll
