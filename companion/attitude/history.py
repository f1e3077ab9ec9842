"""The plan of `model-following` over time, and its correction for late and early samples."""

from bisect import bisect_right
from collections.abc import Sequence
from typing import Generic, NamedTuple, TypeVar

_PLANS_PER_DROP = 64
"""Number of plans of a `PlanSeries` that are dropped together when older than `max_delay`."""


def locate_time(times: Sequence[float], time: float) -> tuple[int, float]:
    """Find `time` in at least two ascending `times`, for linear interpolation or extrapolation.

    Returns:
        The index i of the later neighbour, and the share of the interval from times[i − 1] to
        times[i] that has passed at `time`: below 0 before the first time, above 1 after the last.
    """
    later_index, last_index = bisect_right(times, time), len(times) - 1
    later_index = 1 if later_index < 1 else last_index if later_index > last_index else later_index
    earlier_time = times[later_index - 1]
    return later_index, (time - earlier_time) / (times[later_index] - earlier_time)


class PlannedTilt(NamedTuple):
    """The planned tilt at one time.

    Attributes:
        north, east: planned coefficients: horizontal components of the thrust's direction.
        heading_hold_angle: integral of `heading_hold_rate` (below) since the start, rad.
        x_rate, y_rate: planned roll and pitch rate at heading 0, rad/s.
        x_slope, y_slope: derivatives of `x_rate` and `y_rate`, rad/s².
        heading_hold_rate: yaw rate that keeps the heading constant while the tilt changes, rad/s
            (R_z in the paper).
    """

    north: float
    east: float
    heading_hold_angle: float
    x_rate: float
    y_rate: float
    x_slope: float
    y_slope: float
    heading_hold_rate: float


class PlannedYaw(NamedTuple):
    """The plan of the heading at one time, and the predicted yaw of the body.

    Attributes:
        heading: planned heading, rad, not wrapped.
        body_yaw: integral of `body_yaw_rate` since the start, rad.
        body_yaw_rate: predicted yaw rate of the body in response to the rates sent, rad/s.
    """

    heading: float
    body_yaw: float
    body_yaw_rate: float


Plan = TypeVar("Plan", PlannedTilt, PlannedYaw)


class PlanSeries(Generic[Plan]):
    """A plan as values at ascending times; between two times it is interpolated linearly.

    Args:
        max_delay: the longest delay that is looked up, s.
    """

    def __init__(self, max_delay: float) -> None:
        self._max_delay = max_delay
        self._times: list[float] = []
        self._plans: list[Plan] = []

    def start(self, time: float, plan: Plan, change_per_second: Plan) -> None:
        """Start again with `plan` at `time`, s.

        For earlier times the plan is extrapolated; `change_per_second` is its change per second.
        """
        earliest_plan = type(plan)(
            *[a - self._max_delay * b for a, b in zip(plan, change_per_second, strict=True)]
        )
        self._times[:] = [time - self._max_delay, time]
        self._plans[:] = [earliest_plan, plan]

    def add(self, time: float, plan: Plan) -> None:
        """Add a newer plan; drop plans that are older than the longest delay."""
        times = self._times
        times.append(time)
        self._plans.append(plan)
        if len(times) > _PLANS_PER_DROP and times[_PLANS_PER_DROP] < time - self._max_delay:
            del times[:_PLANS_PER_DROP], self._plans[:_PLANS_PER_DROP]

    @property
    def newest(self) -> Plan:
        """The plan that was added last."""
        return self._plans[-1]

    def at(self, time: float) -> Plan:
        """The plan at `time`, interpolated; before the first and after the last, extrapolated."""
        later_index, fraction = locate_time(self._times, time)
        earlier_plan, later_plan = self._plans[later_index - 1], self._plans[later_index]
        return type(earlier_plan)(
            *[a + fraction * (b - a) for a, b in zip(earlier_plan, later_plan, strict=True)]
        )


class HeadingChange(NamedTuple):
    """The predicted change of the body's heading when a plan takes effect.

    Attributes:
        angle: change of the heading since planning began, rad.
        rate: rate of the heading, rad/s.
    """

    angle: float
    rate: float


class PlanHistory:
    """The plans of tilt and heading, and when they take effect.

    A plan for time t takes effect at t plus the dead time, which differs for tilt and heading.

    Args:
        dead_time: the larger dead time of roll and pitch, s.
        yaw_dead_time: dead time of yaw, s.
        longest_period: longest sample period, s.

    Attributes:
        time: time of the newest plan, s since the start.
        tilt: the plan of the tilt.
        yaw: the plan of the heading.
    """

    def __init__(self, dead_time: float, yaw_dead_time: float, longest_period: float) -> None:
        self._dead_time, self._yaw_dead_time = dead_time, yaw_dead_time
        max_delay = max(dead_time, yaw_dead_time) + longest_period
        self.time = 0.0
        self.tilt: PlanSeries[PlannedTilt] = PlanSeries(max_delay)
        self.yaw: PlanSeries[PlannedYaw] = PlanSeries(max_delay)
        self._heading_change_plan: PlannedTilt | None = None
        self._heading_change = HeadingChange(0.0, 0.0)  # when `_heading_change_plan` takes effect

    def add(self, dt: float, tilt: PlannedTilt, yaw: PlannedYaw) -> None:
        """Add a plan for `dt` seconds after the time of the newest plan."""
        self.time += dt
        self.tilt.add(self.time, tilt)
        self.yaw.add(self.time, yaw)

    def in_effect(self, lateness: float) -> tuple[PlannedTilt, PlannedYaw]:
        """The plans in effect at the newest sample, which came `lateness` s later than expected."""
        now = self.time + lateness
        return self.tilt.at(now - self._dead_time), self.yaw.at(now - self._yaw_dead_time)

    def predicted_heading_change(self, plan_time: float, plan: PlannedTilt) -> HeadingChange:
        """The heading change when `plan`, made for the time `plan_time` (s), takes effect.

        The heading turns at the body's yaw rate minus `heading_hold_rate`.
        """
        # Cached, because both axes and `TargetFrame` ask for the newest plan.
        if plan is not self._heading_change_plan:
            effect_time = plan_time + self._dead_time
            yaw_plan = self.yaw.at(effect_time - self._yaw_dead_time)
            self._heading_change = HeadingChange(
                yaw_plan.body_yaw - plan.heading_hold_angle,
                yaw_plan.body_yaw_rate - plan.heading_hold_rate,
            )
            self._heading_change_plan = plan
        return self._heading_change

    def predicted_yaw_change(self, seconds: float) -> float:
        """Predicted yaw of the body, rad, in `seconds` after the newest tilt plan takes effect."""
        effect_time = self.time + self._dead_time - self._yaw_dead_time
        return self.yaw.at(effect_time + seconds).body_yaw - self.yaw.at(effect_time).body_yaw


_PERIOD_WEIGHT = 0.05
"""Weight of the newest sample period in the expected period, a running mean."""


class SampleHold:
    """Corrects the rates for samples that come earlier or later than expected.

    The rates of each step of the plan are meant for the expected sample period, but the vehicle
    keeps them until the next sample. If that sample is late or early (PX4: after 4 or 8 ms,
    ArduPilot: some in pairs), the vehicle has turned too far or not far enough, and a step would
    not be straight. The next rates correct this error; a sample that is more than one period late
    is corrected as if it were one period late.

    Attributes:
        lateness: how much later than expected the newest sample came, s; negative if it was early.
        period: expected sample period, s; 0 before the first sample.
        plan_dt: time by which the plan advances, s.
    """

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Forget the rates that were sent and the expected period."""
        self.period = self.lateness = self.plan_dt = self._roll = self._pitch = (
            self._lateness_share
        ) = 0.0

    def note_sample(self, dt: float) -> None:
        """Update the attributes for a new sample, `dt` seconds after the last one."""
        expected_period = self.period or dt
        self.lateness = lateness = dt - expected_period
        # Bounded, so that the plan always advances.
        bounded_lateness = max(min(lateness, expected_period), -0.5 * dt / _PERIOD_WEIGHT)
        self.period = period = expected_period + _PERIOD_WEIGHT * bounded_lateness
        self.plan_dt = period + lateness
        self._lateness_share = min(lateness / period, 1.0)

    def rates(self, roll: float, pitch: float) -> tuple[float, float]:
        """The planned rates, corrected because the newest sample came late or early, rad/s.

        Args:
            roll: mean roll rate that is planned for the newest step, rad/s.
            pitch: mean pitch rate that is planned for the newest step, rad/s.
        """
        self._roll = roll + self._lateness_share * (roll - self._roll)
        self._pitch = pitch + self._lateness_share * (pitch - self._pitch)
        return self._roll, self._pitch
