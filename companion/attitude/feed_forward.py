"""Plans the motion of `model-following`, and computes body rates that compensate the lag."""

from math import cos, sin, sqrt

from companion.attitude.history import PlanHistory, PlannedTilt, PlannedYaw
from companion.attitude.kinematics import (
    half_tilt_products,
    heading_of,
    rates_to_speed,
    rotate_to_heading,
)
from companion.attitude.limits import Constants
from companion.attitude.rate_response import AxisResponse, RateLoopResponse
from companion.attitude.reference_model import ReferenceModel, model_lag
from companion.attitude.rotation import clamp
from companion.attitude.types import BodyRates, Coefficients, Quaternion, Target
from companion.attitude.yaw import HeadingModel, TargetFrame, YawModel

ROLL, PITCH = 0, 1


class AxisLead:
    """Compensates the lag of one axis: commands ω + τ·ω̇ + σ·ω̈ for a planned rate ω.

    τ and σ are `lag` and `sigma` of the `AxisResponse`. The axis with the shorter dead time follows
    older plans, so that a plan takes effect on both axes at the same time.

    Args:
        index: `ROLL` or `PITCH`.
        plan_delay: larger dead time of roll and pitch minus that of this axis, s.
    """

    def __init__(
        self, index: int, axis: AxisResponse, plan_delay: float, plans: PlanHistory
    ) -> None:
        self._index = index
        self._lag, self._sigma = axis.lag, axis.sigma
        self._plan_delay = plan_delay
        self._plans = plans

    def advance(self) -> None:
        """Advance to the plan for the time `plan_delay` seconds before that of the newest plan."""
        plans = self._plans
        plan_time = plans.time - self._plan_delay
        self._plan = plans.tilt.at(plan_time) if self._plan_delay else plans.tilt.newest
        self._heading_change = plans.predicted_heading_change(plan_time, self._plan)

    def command(self, dt: float, start_heading: float) -> float:
        """Advance to the next plan; return the rate to send between the two plans, rad/s.

        Each plan is rotated into the body axes predicted for the time of that plan.

        Args:
            dt: time from the last plan to the next one, s.
            start_heading: see `FeedForward.advance`.
        """
        rate, derivative = self._planned_rate(start_heading)
        self.advance()
        next_rate, next_derivative = self._planned_rate(start_heading)
        return (
            0.5 * (rate + next_rate)
            + self._lag / dt * (next_rate - rate)
            + self._sigma / dt * (next_derivative - derivative)
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


class FeedForward:
    """Plans a smooth, straight motion within the limits, and the body rates that follow it.

    The `ReferenceModel` plans the coefficients, the `HeadingModel` the heading. `AxisLead`
    compensates the lag of each axis. A rate takes effect one dead time after it was sent. The axis
    with the shorter dead time is delayed, so that roll and pitch take effect at the same time.

    Yaw responds slowly, so the heading changes while the vehicle tilts. `YawModel` predicts this
    from the yaw rates that were sent. Roll and pitch rates are along the body axes predicted for
    the time when they take effect.

    Args:
        longest_period: longest sample period, s.

    Attributes:
        plans: the plans of tilt and heading, and when they take effect.
        target_frame: heading of ArduPilot's attitude target.
        tilt: responses of roll and pitch.
        yaw: response of yaw.
        lag: the larger lag of roll and pitch, s.
        dead_time: the larger dead time of roll and pitch, s.
    """

    def __init__(
        self, constants: Constants, response: RateLoopResponse, longest_period: float
    ) -> None:
        axes = response.roll, response.pitch, response.yaw
        roll, pitch, yaw = (axis.with_least_lag() for axis in axes)
        self.tilt = tilt = roll, pitch
        self.yaw = yaw
        self.lag = max(axis.lag for axis in tilt)
        self.dead_time = dead_time = max(axis.dead_time for axis in tilt)
        self.target_frame = TargetFrame(response)
        self._model = ReferenceModel(
            constants,
            model_lag(constants.gain, self.lag),
            min(axis.acceleration for axis in tilt),
            max(axis.sigma for axis in tilt),
        )
        self._heading_model = HeadingModel(constants, yaw)
        self._yaw_model = YawModel(yaw)
        self.plans = PlanHistory(dead_time, yaw.dead_time, longest_period)
        self._roll = AxisLead(ROLL, roll, dead_time - roll.dead_time, self.plans)
        self._pitch = AxisLead(PITCH, pitch, dead_time - pitch.dead_time, self.plans)
        self._max_yaw_rate = constants.max_yaw_rate
        self._heading_hold_rate = 0.0

    def retune(self, constants: Constants) -> None:
        """Use these gains and limits from the next sample on; the planned motion continues."""
        self._max_yaw_rate = constants.max_yaw_rate
        self._model.retune(constants, model_lag(constants.gain, self.lag))
        self._heading_model.retune(constants)

    def start(self, q: Quaternion, body_rates: BodyRates | None) -> None:
        """Start the plan at `q`, a unit quaternion with a tilt below the recovery angle.

        `body_rates`: rates at the start of the plan, rad/s; None: at rest.
        """
        w, x, y, z = q
        a_squared, ax, ay = half_tilt_products(w, x, y, z)
        north = east = turn_rate = yaw_rate = 0.0
        if body_rates is not None:
            yaw_rate = body_rates[2]
            north, east, turn_rate = rates_to_speed(w, x, y, z, *body_rates)
        # The rates sent for this sample take effect one dead time later: the plan begins there.
        dead_time, yaw_dead_time = self.dead_time, self.yaw.dead_time
        c = Coefficients(-2.0 * ay + dead_time * north, 2.0 * ax + dead_time * east)
        heading = heading_of(sqrt(a_squared), w, z) + yaw_dead_time * turn_rate
        model = self._model
        model.start_at(c, Coefficients(north, east))
        self._heading_model.start_at(heading, turn_rate)
        self._yaw_model.start(yaw_rate)
        self.target_frame.forget()
        x_rate, y_rate, self._heading_hold_rate = model.rates()
        plans = self.plans
        plans.time = 0.0
        plans.tilt.start(
            0.0,
            PlannedTilt(
                *(model.north, model.east, 0.0, x_rate, y_rate, 0.0, 0.0, self._heading_hold_rate)
            ),
            PlannedTilt(north, east, self._heading_hold_rate, 0.0, 0.0, 0.0, 0.0, 0.0),
        )
        plans.yaw.start(
            0.0, PlannedYaw(heading, 0.0, yaw_rate), PlannedYaw(turn_rate, yaw_rate, 0.0)
        )
        self._roll.advance()
        self._pitch.advance()

    def advance(
        self, target: Target, start_heading: float, yaw_feedback: float, dt: float
    ) -> tuple[float, float, float]:
        """Advance the plan by `dt` s; return lag-compensated body rates that follow it, rad/s.

        Args:
            target: target within the limits; see `limited_target`.
            start_heading: heading at the start of the plan, rad: the present heading of the body
                minus its predicted turn since the start.
            yaw_feedback: feedback to add to the yaw rate, rad/s.
            dt: time by which the plan advances, s.
        """
        model, heading_model, yaw_model = self._model, self._heading_model, self._yaw_model
        last_hold_rate, last_turn_rate = self._heading_hold_rate, heading_model.turn_rate
        model.advance(target, dt)
        heading_model.advance(target, dt)
        x_rate, y_rate, hold_rate = model.rates()
        turn_rate = heading_model.turn_rate
        yaw_rate = (
            0.5 * (last_hold_rate + hold_rate + last_turn_rate + turn_rate)
            + self.yaw.lag / dt * (hold_rate - last_hold_rate + turn_rate - last_turn_rate)
            + yaw_feedback
        )
        yaw_rate = clamp(yaw_rate, self._max_yaw_rate)
        yaw_model.advance(yaw_rate, dt)
        self._heading_hold_rate = hold_rate
        mean_hold_rate = 0.5 * (last_hold_rate + hold_rate)
        self.target_frame.advance(yaw_rate, mean_hold_rate, dt)
        plans = self.plans
        hold_angle = plans.tilt.newest.heading_hold_angle + mean_hold_rate * dt
        slopes = model.rate_slopes(x_rate, y_rate)
        plans.add(
            dt,
            PlannedTilt(model.north, model.east, hold_angle, x_rate, y_rate, *slopes, hold_rate),
            PlannedYaw(heading_model.heading, yaw_model.yaw_angle, yaw_model.rate),
        )
        return (
            self._roll.command(dt, start_heading),
            self._pitch.command(dt, start_heading),
            yaw_rate,
        )
