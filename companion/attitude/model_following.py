"""`model-following`: past the paper, a response that stays linear behind a real rate loop."""

from dataclasses import replace
from math import cos, radians, sin, sqrt

from companion.attitude.axis_lead import PITCH, ROLL, AxisLead, Turn
from companion.attitude.first_order import first_order
from companion.attitude.history import History, PlannedTilt, PlannedYaw, SampleHold
from companion.attitude.kinematics import (
    heading_of,
    into_body,
    rates_to_speed,
    speed_to_rates,
    tilt_products,
)
from companion.attitude.limits import Constants
from companion.attitude.rate_response import AxisResponse, RateResponse, largest_gain
from companion.attitude.reference_model import ReferenceModel, model_lag
from companion.attitude.representation import admissible, is_unit, normalised, wrap_angle
from companion.attitude.rotation import within, within_limits
from companion.attitude.types import (
    BodyRates,
    Coefficients,
    InvalidBodyRatesError,
    Quaternion,
    Target,
)
from companion.attitude.yaw import HeadingModel, TargetFrame, YawModel

SHARE_OF_LARGEST_GAIN = 0.25
"""Of the largest stable gain, at most this is fed back: a gain margin of 4, and no overshoot."""

FURTHEST_AHEAD = radians(45.0)
"""ArduPilot does not let its attitude target lead the body in yaw by more."""

SHORTEST_SAMPLE, LONGEST_SAMPLE = 1e-4, 0.2  # s
_FASTEST = 100.0  # rad/s
_QUICKEST = 1e-3  # s, of a lag: quicker ones make no difference at any sample rate


class ModelFollowingPlanner:
    """Two degrees of freedom: a planned motion is fed forward, what differs from it is fed back.

    The plan is a `ReferenceModel`: smooth, straight, within the limits. Fed forward are the body
    rates that move the attitude along it in the middle of the coming sample, each led by the lag of
    its own axis (`AxisLead`). They take effect one dead time later, on both axes at once, for the
    quicker one waits. So fed back is the difference of the measured coefficients from the plan as
    it stood one dead time ago, by the paper's law; that way the loop does not fight its own delay.
    The gain of the feedback is p, but at most a quarter of what is stable for dead time and lag of
    the slower axis (`margin.largest_gain`): it stays stable as long as the real largest gain is
    more than a quarter of the one believed. Heading is treated likewise. A larger gain would be
    stable too, and worse where the dead time is known wrongly.

    Yaw answers slowly, so while the vehicle tilts its heading moves although it is asked to stand
    still. It is foreseen from the yaw rates that were sent (`YawModel`), and the tilt rates are
    turned into the body as it will stand when they act.

    The rates are those of the body's axes. Where the autopilot takes them along other axes, those
    of its attitude target (`TargetFrame`), they are turned into these last.

    Past the recovery angle it answers as `first-order` does, and starts anew below it.

    Args:
        constants: gains and limits.
        response: of the vehicle's rate loop.
    """

    def __init__(self, constants: Constants, response: RateResponse) -> None:
        roll, pitch, yaw = (_no_quicker(axis) for axis in response.axes)
        tilt = roll, pitch
        self._constants = constants
        self._yaw = yaw
        self._lag = max(axis.lag for axis in tilt)
        self._dead_time = dead_time = max(axis.dead_time for axis in tilt)
        self._frame_lead = response.lead
        self._frame = TargetFrame(response)
        self._hold = SampleHold()
        self._gain = min(_fed_back(constants.gain, axis) for axis in tilt)
        self._yaw_gain = _fed_back(constants.yaw_gain, yaw)
        self._model = ReferenceModel(
            constants,
            model_lag(constants.gain, self._lag),
            min(axis.acceleration for axis in tilt),
            max(axis.square for axis in tilt),
        )
        self._heading = HeadingModel(constants, yaw)
        self._body = YawModel(yaw)
        span = max(dead_time, yaw.dead_time) + LONGEST_SAMPLE
        self._past: History[PlannedTilt] = History(span)
        self._past_yaw: History[PlannedYaw] = History(span)
        self._roll = AxisLead(ROLL, roll, dead_time - roll.dead_time, self._past)
        self._pitch = AxisLead(PITCH, pitch, dead_time - pitch.dead_time, self._past)
        self._still = 0.0
        self._time = 0.0
        self._started = False

    def reset(self, q: Quaternion, body_rates: BodyRates | None = None) -> None:
        """Plan anew from here: after a gap, a change of mode, or a jump of the estimate.

        Past the recovery angle there is nothing to plan: the plan begins when the tilt is below it.

        Args:
            q: attitude.
            body_rates: rad/s; the plan goes on with them. None, or what no vehicle does: at rest.

        Raises:
            InvalidQuaternionError: `q` is not a unit quaternion.
            InvalidBodyRatesError: `body_rates` are not three numbers.
        """
        w, x, y, z = q = normalised(q)
        square, _, _ = tilt_products(w, x, y, z)
        believed = _believable(body_rates)
        self._started = 2.0 * square - 1.0 >= self._constants.cos_recovery
        if self._started:
            self._start(q, believed)

    def _start(self, q: Quaternion, body_rates: BodyRates | None) -> None:
        """Begin the plan at `q`, a unit quaternion below the recovery angle."""
        self._hold.restart()
        w, x, y, z = q
        square, ax, ay = tilt_products(w, x, y, z)
        north = east = turn_rate = yaw_rate = 0.0
        if body_rates is not None:
            yaw_rate = body_rates[2]
            north, east, turn_rate = rates_to_speed(w, x, y, z, *body_rates)
        # What is answered now takes effect one dead time later: the plan begins there.
        ahead, yaw_ahead = self._dead_time, self._yaw.dead_time
        c = Coefficients(-2.0 * ay + ahead * north, 2.0 * ax + ahead * east)
        heading = heading_of(sqrt(square), w, z) + yaw_ahead * turn_rate
        model = self._model
        model.place(c, Coefficients(north, east))
        self._heading.place(heading, turn_rate)
        self._body.start(yaw_rate)
        self._frame.forget()
        x, y, self._still = model.rates()
        self._time = 0.0
        self._past.start(
            0.0,
            PlannedTilt(model.north, model.east, 0.0, x, y, 0.0, 0.0, self._still),
            PlannedTilt(north, east, self._still, 0.0, 0.0, 0.0, 0.0, 0.0),
        )
        self._past_yaw.start(
            0.0, PlannedYaw(heading, 0.0, yaw_rate), PlannedYaw(turn_rate, yaw_rate, 0.0)
        )
        self._roll.advance(0.0, self._turn_when)
        self._pitch.advance(0.0, self._turn_when)

    def note_attitude_target(self, q: Quaternion, age: float) -> None:
        """The autopilot takes the rates along the axes of `q`, which stood so `age` s ago.

        By the time of the newest sample. One that is not usable is passed over.
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
        """Body rates in rad/s that answer attitude `q`; `dt` is the time since the last sample.

        Raises:
            InvalidQuaternionError: `q` is not a unit quaternion.
            InvalidTargetError: a value of `target` is not finite.
            InvalidBodyRatesError: `body_rates` are not three numbers.
        """
        constants = self._constants
        w, x, y, z = q = normalised(q)
        target = admissible(target, constants.longest_target)
        square, ax, ay = tilt_products(w, x, y, z)
        cosine = 2.0 * square - 1.0
        believed = _believable(body_rates)
        if cosine < constants.cos_recovery:
            self._started = False
            return BodyRates(*first_order(q, target, dt, constants))
        if not self._started:
            self._start(q, believed)
            self._started = True
        dt = min(max(SHORTEST_SAMPLE, dt), LONGEST_SAMPLE)  # in this order NaN is short, too
        north, east, heading = -2.0 * ay, 2.0 * ax, heading_of(sqrt(square), w, z)
        self._hold.take(dt)
        now, dt = self._time + self._hold.late, self._hold.step
        by_tilt = self._past.at(now - self._dead_time)
        by_yaw = self._past_yaw.at(now - self._yaw.dead_time)
        north_speed, east_speed, turn = self._feedback(by_tilt, by_yaw, north, east, heading)
        more_roll, more_pitch, more_yaw = speed_to_rates(
            w, z, ax, ay, 1.0 / square, 1.0 / cosine, east_speed, -north_speed
        )
        if believed is not None:  # what turns beyond what was foreseen does so until this acts
            unforeseen = believed.yaw - by_yaw.turning
            heading += (self._dead_time + self._lag) * unforeseen
        heading += by_tilt.still - by_yaw.turned
        ahead = self._frame_ahead(heading)
        roll, pitch, yaw = self._feed_forward(target, heading, more_yaw + turn, dt)
        roll, pitch = self._hold.rates(roll, pitch)
        ahead = 0.5 * (ahead + self._frame_ahead(heading))
        roll, pitch = into_body(cos(ahead), sin(ahead), roll + more_roll, pitch + more_pitch)
        return BodyRates(
            *within_limits(roll, pitch, yaw, constants.max_tilt_rate, constants.max_yaw_rate)
        )

    def _feedback(
        self, by_tilt: PlannedTilt, by_yaw: PlannedYaw, north: float, east: float, heading: float
    ) -> tuple[float, float, float]:
        """Speed of the coefficients (1/s) and of the heading (rad/s), back towards the plan.

        The plan as it stood one dead time ago; during the first dead time after a start nothing
        planned has had an effect yet.
        """
        speed_north = speed_east = turn = 0.0
        if self._time >= self._dead_time:
            speed_north = self._gain * (by_tilt.north - north)
            speed_east = self._gain * (by_tilt.east - east)
        if self._time >= self._yaw.dead_time:
            turn = self._yaw_gain * wrap_angle(by_yaw.heading - heading)
        return speed_north, speed_east, turn

    def _feed_forward(
        self, target: Target, heading: float, yaw_feedback: float, dt: float
    ) -> tuple[float, float, float]:
        """Move the plan on by a sample; the rates that follow it there, led by the lags.

        Args:
            target: admissible.
            heading: when the answer acts, but for what is planned to turn until then, rad.
            yaw_feedback: what is added to the yaw rate, rad/s.
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
        yaw = within(yaw, self._constants.max_yaw_rate)
        self._body.advance(yaw, dt)
        self._still = still_after
        still = 0.5 * (still_before + still_after)
        self._frame.advance(yaw, still, dt)
        self._remember(x, y, still * dt, dt)
        return (
            self._roll.command(self._time, dt, heading, self._turn_when),
            self._pitch.command(self._time, dt, heading, self._turn_when),
            yaw,
        )

    def _turn_when(self, planned_for: float, plan: PlannedTilt) -> Turn:
        """How the body will have turned by its yaw rate, less what keeps the heading, when it acts.

        What is planned for a time acts one dead time of the tilt later.
        """
        acts = planned_for + self._dead_time
        body = self._past_yaw.at(acts - self._yaw.dead_time)
        return Turn(body.turned - plan.still, body.turning - plan.z)

    def _frame_ahead(self, heading: float) -> float:
        """By how much the axes along which the rates are taken lead the body in yaw then, rad.

        As they were told, else by their lead in time.

        Args:
            heading: of the body, but for what `_turn_when` says, rad.
        """
        told = self._frame.heading()
        if told is not None:
            ahead = wrap_angle(
                told - heading - self._turn_when(self._time, self._past.newest).angle
            )
            if abs(ahead) <= FURTHEST_AHEAD:
                return ahead
        if self._frame_lead == 0.0:
            return 0.0
        acts = self._time + self._dead_time - self._yaw.dead_time
        past = self._past_yaw
        return past.at(acts + self._frame_lead).turned - past.at(acts).turned

    def _remember(self, x: float, y: float, stilled: float, dt: float) -> None:
        """Note the plan as it stands `dt` later; `stilled` rad of yaw keep its heading still."""
        model, body = self._model, self._body
        still = self._past.newest.still + stilled
        slopes = model.rate_slopes()
        self._time += dt
        self._past.add(
            self._time, PlannedTilt(model.north, model.east, still, x, y, *slopes, self._still)
        )
        self._past_yaw.add(self._time, PlannedYaw(self._heading.heading, body.turned, body.rate))


def _believable(body_rates: BodyRates | None) -> BodyRates | None:
    """None for rates that no vehicle has or that are NaN: the plan must not take them in.

    Raises:
        InvalidBodyRatesError: these are not three numbers.
    """
    if body_rates is None:
        return None
    try:
        roll, pitch, yaw = body_rates
        if abs(roll) < _FASTEST and abs(pitch) < _FASTEST and abs(yaw) < _FASTEST:
            return BodyRates(roll, pitch, yaw)
    except (TypeError, ValueError) as error:
        raise InvalidBodyRatesError(f"body rates are three numbers: {error}") from error
    return None


def _no_quicker(axis: AxisResponse) -> AxisResponse:
    return replace(axis, lag=max(axis.lag, _QUICKEST))


def _fed_back(gain: float, axis: AxisResponse) -> float:
    stable = SHARE_OF_LARGEST_GAIN * largest_gain(axis.lag, axis.dead_time, axis.square)
    return min(gain, stable)
