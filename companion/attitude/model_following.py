"""`model-following`: a response that stays linear behind a real rate loop, beyond the paper."""

from math import cos, sin, sqrt

from companion.attitude.axis_lead import PITCH, ROLL, AxisLead
from companion.attitude.first_order import first_order
from companion.attitude.history import PlanHistory, PlannedTilt, PlannedYaw, SampleHold
from companion.attitude.kinematics import (
    heading_of,
    into_body,
    rates_to_speed,
    speed_to_rates,
    tilt_products,
)
from companion.attitude.limits import Constants
from companion.attitude.rate_response import RateResponse, feedback_gain
from companion.attitude.reference_model import ReferenceModel, model_lag
from companion.attitude.representation import (
    is_unit,
    limited_target,
    normalised,
    plausible_rates,
    wrap_angle,
)
from companion.attitude.rotation import clamp, limit_rates
from companion.attitude.types import BodyRates, Coefficients, Quaternion, Target
from companion.attitude.yaw import HeadingModel, TargetFrame, YawModel

SHORTEST_SAMPLE, LONGEST_SAMPLE = 1e-4, 0.2  # s


class ModelFollowingPlanner:
    """Two degrees of freedom: a planned motion is fed forward, the deviation from it is fed back.

    Feedforward: the `ReferenceModel` plans a smooth, straight motion within the limits. `AxisLead`
    compensates the lag of each axis. The rates take effect one dead time later; the quicker axis
    is delayed, so that roll and pitch take effect at the same time.

    Feedback: the measured coefficients are compared with the plan of one dead time ago, which is
    the plan in effect now. The gain is p, but at most a quarter of the largest stable gain of the
    slower axis (`rate_response.feedback_gain`). The heading is fed back in the same way.

    Yaw responds slowly, so the heading moves while the vehicle tilts. `YawModel` predicts this from
    the yaw rates that were sent. Roll and pitch rates are rotated into the body axes predicted for
    the time when they take effect. ArduPilot takes the rates along the axes of its attitude target
    instead; `TargetFrame` gives the rotation into these.

    Beyond the recovery angle the rates are those of `first-order`; a new plan begins below it.

    Args:
        constants: gains and limits.
        response: response of the vehicle's rate loop.
    """

    def __init__(self, constants: Constants, response: RateResponse) -> None:
        roll, pitch, yaw = (axis.with_least_lag() for axis in response.axes)
        self._tilt = tilt = roll, pitch
        self._yaw = yaw
        self._lag = max(axis.lag for axis in tilt)
        self._dead_time = dead_time = max(axis.dead_time for axis in tilt)
        self._frame = TargetFrame(response)
        self._hold = SampleHold()
        self._model = ReferenceModel(
            constants,
            model_lag(constants.gain, self._lag),
            min(axis.acceleration for axis in tilt),
            max(axis.square for axis in tilt),
        )
        self._heading = HeadingModel(constants, yaw)
        self._body = YawModel(yaw)
        self._plans = PlanHistory(dead_time, yaw.dead_time, LONGEST_SAMPLE)
        self._roll = AxisLead(ROLL, roll, dead_time - roll.dead_time, self._plans)
        self._pitch = AxisLead(PITCH, pitch, dead_time - pitch.dead_time, self._plans)
        self._still = 0.0
        self._started = False
        self.planned: PlannedTilt | None = None
        self.retune(constants)

    def retune(self, constants: Constants) -> None:
        """Use these gains and limits from the next sample on; the planned motion continues."""
        self._constants = constants
        self._gain = min(feedback_gain(constants.gain, axis) for axis in self._tilt)
        self._yaw_gain = feedback_gain(constants.yaw_gain, self._yaw)
        self._model.retune(constants, model_lag(constants.gain, self._lag))
        self._heading.retune(constants)

    def reset(self, q: Quaternion, body_rates: BodyRates | None = None) -> None:
        """Begin a new plan at `q`: after a gap, a change of mode, or a jump of the estimate.

        Args:
            q: attitude; beyond the recovery angle the plan begins when the tilt is below it.
            body_rates: rates at the beginning of the plan, rad/s; None or implausible: at rest.

        Raises:
            InvalidQuaternionError: `q` is not a unit quaternion.
            InvalidBodyRatesError: `body_rates` are not three numbers.
        """
        w, x, y, z = q = normalised(q)
        square, _, _ = tilt_products(w, x, y, z)
        plausible = plausible_rates(body_rates)
        self._started = 2.0 * square - 1.0 >= self._constants.cos_recovery
        if self._started:
            self._start(q, plausible)

    def _start(self, q: Quaternion, body_rates: BodyRates | None) -> None:
        """Begin the plan at `q`, a unit quaternion below the recovery angle."""
        self._hold.restart()
        w, x, y, z = q
        square, ax, ay = tilt_products(w, x, y, z)
        north = east = turn_rate = yaw_rate = 0.0
        if body_rates is not None:
            yaw_rate = body_rates[2]
            north, east, turn_rate = rates_to_speed(w, x, y, z, *body_rates)
        # The rates sent for this sample take effect one dead time later: the plan begins there.
        ahead, yaw_ahead = self._dead_time, self._yaw.dead_time
        c = Coefficients(-2.0 * ay + ahead * north, 2.0 * ax + ahead * east)
        heading = heading_of(sqrt(square), w, z) + yaw_ahead * turn_rate
        model = self._model
        model.start_at(c, Coefficients(north, east))
        self._heading.start_at(heading, turn_rate)
        self._body.start(yaw_rate)
        self._frame.forget()
        x, y, self._still = model.rates()
        plans = self._plans
        plans.time = 0.0
        plans.tilt.start(
            0.0,
            PlannedTilt(model.north, model.east, 0.0, x, y, 0.0, 0.0, self._still),
            PlannedTilt(north, east, self._still, 0.0, 0.0, 0.0, 0.0, 0.0),
        )
        plans.yaw.start(
            0.0, PlannedYaw(heading, 0.0, yaw_rate), PlannedYaw(turn_rate, yaw_rate, 0.0)
        )
        self._roll.advance()
        self._pitch.advance()

    def note_attitude_target(self, q: Quaternion, age: float) -> None:
        """Take the attitude target of ArduPilot, which takes body rates along the target's axes.

        Args:
            q: attitude target; ignored if it is not a unit quaternion.
            age: time from the attitude target to the newest sample, s.
        """
        if not (self._started and is_unit(q)):
            return
        w, x, y, z = normalised(q)
        square, _, _ = tilt_products(w, x, y, z)
        if 2.0 * square - 1.0 >= self._constants.cos_recovery:
            self._frame.note(heading_of(sqrt(square), w, z), age)

    def rates(
        self, q: Quaternion, target: Target, dt: float, body_rates: BodyRates | None = None
    ) -> BodyRates:
        """Body rates to send at attitude `q`, rad/s; `dt` is the time since the last sample, s.

        Raises:
            InvalidQuaternionError: `q` is not a unit quaternion.
            InvalidTargetError: a value of `target` is not finite.
            InvalidBodyRatesError: `body_rates` are not three numbers.
        """
        constants = self._constants
        w, x, y, z = q = normalised(q)
        target = limited_target(target, constants.longest_target)
        square, ax, ay = tilt_products(w, x, y, z)
        cosine = 2.0 * square - 1.0
        plausible = plausible_rates(body_rates)
        if cosine < constants.cos_recovery:
            self._started = False
            self.planned = None
            return BodyRates(*first_order(q, target, dt, constants))
        if not self._started:
            self._start(q, plausible)
            self._started = True
        dt = min(max(SHORTEST_SAMPLE, dt), LONGEST_SAMPLE)  # in this order NaN is short, too
        north, east, heading = -2.0 * ay, 2.0 * ax, heading_of(sqrt(square), w, z)
        self._hold.take(dt)
        dt = self._hold.step
        by_tilt, by_yaw = self._plans.in_effect(self._hold.late)
        self.planned = by_tilt
        north_speed, east_speed, turn = self._feedback(by_tilt, by_yaw, north, east, heading)
        more_roll, more_pitch, more_yaw = speed_to_rates(
            w, z, ax, ay, 1.0 / square, 1.0 / cosine, east_speed, -north_speed
        )
        if plausible is not None:  # an unpredicted yaw rate lasts until these rates take effect
            unpredicted = plausible.yaw - by_yaw.turning
            heading += (self._dead_time + self._lag) * unpredicted
        heading += by_tilt.still - by_yaw.turned
        ahead = self._frame.lead(heading, self._plans)
        roll, pitch, yaw = self._feed_forward(target, heading, more_yaw + turn, dt)
        roll, pitch = self._hold.rates(roll, pitch)
        ahead = 0.5 * (ahead + self._frame.lead(heading, self._plans))
        roll, pitch = into_body(cos(ahead), sin(ahead), roll + more_roll, pitch + more_pitch)
        return BodyRates(
            *limit_rates(roll, pitch, yaw, constants.max_tilt_rate, constants.max_yaw_rate)
        )

    def _feedback(
        self, by_tilt: PlannedTilt, by_yaw: PlannedYaw, north: float, east: float, heading: float
    ) -> tuple[float, float, float]:
        """Feedback towards the plan: speed of north, east (1/s) and heading (rad/s).

        It is 0 in the first dead time after a start, when no plan has taken effect yet.
        """
        speed_north = speed_east = turn = 0.0
        if self._plans.time >= self._dead_time:
            speed_north = self._gain * (by_tilt.north - north)
            speed_east = self._gain * (by_tilt.east - east)
        if self._plans.time >= self._yaw.dead_time:
            turn = self._yaw_gain * wrap_angle(by_yaw.heading - heading)
        return speed_north, speed_east, turn

    def _feed_forward(
        self, target: Target, heading: float, yaw_feedback: float, dt: float
    ) -> tuple[float, float, float]:
        """Advance the plan by `dt` seconds; return the rates that follow it in spite of lag, rad/s.

        Args:
            target: an admissible target.
            heading: heading of the body minus the turn predicted since the plans began, rad.
            yaw_feedback: feedback to add to the yaw rate, rad/s.
            dt: s.
        """
        still_before, turn_before = self._still, self._heading.turn_rate
        self._model.advance(target, dt)
        self._heading.advance(target, dt)
        x, y, still_after = self._model.rates()
        turn_after = self._heading.turn_rate
        yaw = (
            0.5 * (still_before + still_after + turn_before + turn_after)
            + self._yaw.lag / dt * (still_after - still_before + turn_after - turn_before)
            + yaw_feedback
        )
        yaw = clamp(yaw, self._constants.max_yaw_rate)
        self._body.advance(yaw, dt)
        self._still = still_after
        still = 0.5 * (still_before + still_after)
        self._frame.advance(yaw, still, dt)
        self._append_plan(x, y, still * dt, dt)
        return self._roll.command(dt, heading), self._pitch.command(dt, heading), yaw

    def _append_plan(self, x: float, y: float, still_turn: float, dt: float) -> None:
        """Append the plan of `dt` seconds later.

        `x`, `y`: planned roll and pitch rate at heading 0, rad/s. `still_turn`: yaw meanwhile, rad.
        """
        model, body = self._model, self._body
        still = self._plans.tilt.newest.still + still_turn
        slopes = model.rate_slopes(x, y)
        self._plans.add(
            dt,
            PlannedTilt(model.north, model.east, still, x, y, *slopes, self._still),
            PlannedYaw(self._heading.heading, body.turned, body.rate),
        )
