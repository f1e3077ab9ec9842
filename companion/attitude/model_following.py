"""`model-following`: keeps the response linear with a real rate loop; not from the paper."""

from math import cos, sin, sqrt

from companion.attitude.feed_forward import FeedForward
from companion.attitude.first_order import first_order
from companion.attitude.history import PlannedTilt, PlannedYaw, SampleHold
from companion.attitude.kinematics import (
    half_tilt_products,
    heading_of,
    rotate_to_heading,
    speed_to_rates,
)
from companion.attitude.limits import Constants
from companion.attitude.rate_response import RateLoopResponse, feedback_gain
from companion.attitude.representation import (
    is_unit,
    limited_target,
    normalised,
    plausible_rates,
    require_period,
    wrap_angle,
)
from companion.attitude.rotation import limit_rates
from companion.attitude.types import BodyRates, Quaternion, Target

SHORTEST_PERIOD, LONGEST_PERIOD = 1e-4, 0.2  # s


class ModelFollowingPlanner:
    """Two-degree-of-freedom control: feedforward of a planned motion, feedback of the deviation.

    `FeedForward` plans a smooth, straight motion within the limits, and computes its body rates.

    Feedback: the measured coefficients are compared with the plan of one dead time ago, which is
    the plan in effect now. The gain is p, but at most a quarter of the largest stable gain of the
    slower axis (`rate_response.feedback_gain`). The heading is fed back in the same way.

    ArduPilot applies the rates along the axes of its attitude target instead of the body's;
    `TargetFrame` gives the rotation into the axes of that target.

    Beyond the recovery angle the rates are those of `first-order`; a new plan begins below it.

    Attributes:
        plan_in_effect: the plan in effect at the newest sample; None before the first sample and
            beyond the recovery angle.
    """

    def __init__(self, constants: Constants, response: RateLoopResponse) -> None:
        self._feed_forward = FeedForward(constants, response, LONGEST_PERIOD)
        self._sample_hold = SampleHold()
        self._plan_started = False
        self._target: Target | None = None
        self.plan_in_effect: PlannedTilt | None = None
        self.retune(constants)

    def retune(self, constants: Constants) -> None:
        """Use these gains and limits from the next sample on; the planned motion continues."""
        self._constants = constants
        self._gain = min(feedback_gain(constants.gain, axis) for axis in self._feed_forward.tilt)
        self._yaw_gain = feedback_gain(constants.yaw_gain, self._feed_forward.yaw)
        self._feed_forward.retune(constants)

    def reset(self, q: Quaternion, body_rates: BodyRates | None = None) -> None:
        """Start a new plan at `q`: after a gap, a change of mode, or a jump of the estimate.

        Args:
            q: attitude; if its tilt is beyond the recovery angle, the plan starts once it is below.
            body_rates: rates at the start of the plan, rad/s; None or implausible: at rest.

        Raises:
            InvalidQuaternionError: `q` is not a unit quaternion.
            InvalidBodyRatesError: `body_rates` are not three numbers.
        """
        w, x, y, z = q = normalised(q)
        a_squared, _, _ = half_tilt_products(w, x, y, z)
        usable_body_rates = plausible_rates(body_rates)
        self._plan_started = 2.0 * a_squared - 1.0 >= self._constants.cos_recovery
        if self._plan_started:
            self._start(q, usable_body_rates)

    def _start(self, q: Quaternion, body_rates: BodyRates | None) -> None:
        self._sample_hold.restart()
        self._target = None
        self._feed_forward.start(q, body_rates)

    def note_attitude_target(self, q: Quaternion, age: float) -> None:
        """Note the attitude target of ArduPilot, which applies body rates along the target's axes.

        Args:
            q: attitude target; ignored before the plan has started, if it is not a unit quaternion,
                and if its tilt is beyond the recovery angle.
            age: time from the attitude target to the newest sample, s.
        """
        if not (self._plan_started and is_unit(q)):
            return
        w, x, y, z = normalised(q)
        a_squared, _, _ = half_tilt_products(w, x, y, z)
        if 2.0 * a_squared - 1.0 >= self._constants.cos_recovery:
            self._feed_forward.target_frame.note_heading(heading_of(sqrt(a_squared), w, z), age)

    def rates(
        self, q: Quaternion, target: Target, dt: float, body_rates: BodyRates | None = None
    ) -> BodyRates:
        """Body rates to send at attitude `q`, rad/s; `dt` is the time since the last sample, s.

        A `dt` above 0.2 s counts as 0.2 s; reset the planner after such a gap.
        `body_rates` are measured, rad/s; if they are None or implausible, predicted ones are used.

        Raises:
            InvalidQuaternionError: `q` is not a unit quaternion.
            InvalidTargetError: `target` is not three or four finite numbers of usable size.
            InvalidBodyRatesError: `body_rates` are not three numbers.
            InvalidPeriodError: `dt` is not positive and finite.
        """
        require_period(dt)
        constants, feed_forward = self._constants, self._feed_forward
        w, x, y, z = q = normalised(q)
        target = limited_target(target, constants.max_target_norm)
        a_squared, ax, ay = half_tilt_products(w, x, y, z)
        cosine = 2.0 * a_squared - 1.0
        usable_body_rates = plausible_rates(body_rates)
        if cosine < constants.cos_recovery:
            self._plan_started = False
            self.plan_in_effect = None
            return BodyRates(*first_order(q, target, dt, constants))
        if not self._plan_started:
            self._start(q, usable_body_rates)
            self._plan_started = True
        dt = min(max(SHORTEST_PERIOD, dt), LONGEST_PERIOD)
        north, east, heading = -2.0 * ay, 2.0 * ax, heading_of(sqrt(a_squared), w, z)
        self._sample_hold.note_sample(dt)
        tilt_plan, yaw_plan = feed_forward.plans.in_effect(self._sample_hold.lateness)
        self.plan_in_effect = tilt_plan
        v_north, v_east, turn_rate = self._feedback(tilt_plan, yaw_plan, north, east, heading)
        feedback_roll, feedback_pitch, feedback_yaw = speed_to_rates(
            w, z, ax, ay, 1.0 / a_squared, 1.0 / cosine, v_east, -v_north
        )
        if usable_body_rates is not None:  # an unpredicted yaw rate is assumed to last this long
            unpredicted_yaw_rate = usable_body_rates.yaw - yaw_plan.body_yaw_rate
            heading += (feed_forward.dead_time + feed_forward.lag) * unpredicted_yaw_rate
        start_heading = heading + (tilt_plan.heading_hold_angle - yaw_plan.body_yaw)
        lead = feed_forward.target_frame.lead(start_heading, feed_forward.plans)
        roll, pitch, yaw = self._advance(target, start_heading, feedback_yaw + turn_rate)
        roll, pitch = self._sample_hold.rates(roll, pitch)
        lead = 0.5 * (lead + feed_forward.target_frame.lead(start_heading, feed_forward.plans))
        roll, pitch = roll + feedback_roll, pitch + feedback_pitch
        roll, pitch = rotate_to_heading(cos(lead), sin(lead), roll, pitch)
        return BodyRates(
            *limit_rates(roll, pitch, yaw, constants.max_tilt_rate, constants.max_yaw_rate)
        )

    def _advance(
        self, target: Target, start_heading: float, yaw_feedback: float
    ) -> tuple[float, float, float]:
        """Advance the plan to the time of the next expected sample; see `FeedForward.advance`.

        If the newest sample came late, the plan first follows the previous target for that delay,
        because the new target was not known then.
        """
        sample_hold, feed_forward = self._sample_hold, self._feed_forward
        previous_target, self._target = self._target, target
        if (
            previous_target is None
            or previous_target == target
            or sample_hold.lateness < SHORTEST_PERIOD
        ):
            return feed_forward.advance(target, start_heading, yaw_feedback, sample_hold.plan_dt)
        lateness, remaining_dt = sample_hold.lateness, sample_hold.plan_dt - sample_hold.lateness
        first_rates = feed_forward.advance(previous_target, start_heading, yaw_feedback, lateness)
        roll_rate, pitch_rate, yaw_rate = feed_forward.advance(
            target, start_heading, yaw_feedback, remaining_dt
        )
        first_share = lateness / sample_hold.plan_dt
        return (
            roll_rate + first_share * (first_rates[0] - roll_rate),
            pitch_rate + first_share * (first_rates[1] - pitch_rate),
            yaw_rate,
        )

    def _feedback(
        self,
        tilt_plan: PlannedTilt,
        yaw_plan: PlannedYaw,
        north: float,
        east: float,
        heading: float,
    ) -> tuple[float, float, float]:
        """Feedback towards the plan: speeds of the coefficients (1/s) and of the heading (rad/s).

        Both speeds are 0 in the first dead time after the start, when no plan has taken effect yet.
        """
        speed_north = speed_east = turn_rate = 0.0
        feed_forward = self._feed_forward
        if feed_forward.plans.time >= feed_forward.dead_time:
            speed_north = self._gain * (tilt_plan.north - north)
            speed_east = self._gain * (tilt_plan.east - east)
        if feed_forward.plans.time >= feed_forward.yaw.dead_time:
            turn_rate = self._yaw_gain * wrap_angle(yaw_plan.heading - heading)
        return speed_north, speed_east, turn_rate
