"""`model-following`: past the paper, a response that stays linear behind a real rate loop."""

from math import cos, sin, sqrt

from companion.attitude.constants import Constants
from companion.attitude.first_order import first_order
from companion.attitude.history import History, Planned
from companion.attitude.kinematics import (
    heading_of,
    into_body,
    rates_to_speed,
    speed_to_rates,
    tilt_products,
)
from companion.attitude.margin import largest_gain
from companion.attitude.reference_model import ReferenceModel, rates_along
from companion.attitude.representation import normalised, wrap_angle
from companion.attitude.rotation import within_limits
from companion.attitude.target import admissible
from companion.attitude.types import BodyRates, Coefficients, Quaternion, Target

SHARE_OF_LARGEST_GAIN = 0.35
"""Of the largest stable gain, at most this is fed back: a gain margin of 2.9 or more."""

SHORTEST_SAMPLE, LONGEST_SAMPLE = 1e-4, 0.2  # s
_LONGEST = 1.0  # s, of a lag or a dead time
_MOMENT = 0.01  # s, over which the planned turn rate is taken
_QUICKEST = 1e-3  # s, of a lag: quicker ones make no difference at any sample rate


class ModelFollowingPlanner:
    """Two degrees of freedom: a planned motion is fed forward, what differs from it is fed back.

    The plan is a `ReferenceModel`: second order, straight, within the limits. Fed forward are the
    body rates that move the attitude along it in the middle of the coming sample, led by the lag of
    the rate loop (ω + τ·ω̇). They take effect one dead time later, so fed back is the difference of
    the measured coefficients from the plan as it stood one dead time ago, by the paper's law; that
    way the loop does not fight its own delay. The gain of the feedback is p, but at most 0.35 of
    what is stable for dead time and lag (`margin.largest_gain`): it stays stable as long as the
    real largest gain is not less than 0.35 of the one believed. Heading is treated likewise.

    Past the recovery angle it answers as `first-order` does, and starts anew below it.

    Args:
        constants: gains and limits.
        lag: τ of the roll and pitch rate loop, s.
        dead_time: from a sample's time to the beginning of the effect of the answer on roll and
            pitch, s.
        yaw_lag: τ of the yaw rate loop, s.
        yaw_dead_time: the same as `dead_time` for yaw, s.

    Raises:
        ValueError: a lag or a dead time is negative, longer than 1 s, or not finite.
    """

    def __init__(
        self,
        constants: Constants,
        lag: float,
        dead_time: float,
        yaw_lag: float,
        yaw_dead_time: float,
    ) -> None:
        for name, value in (
            ("lag", lag),
            ("dead_time", dead_time),
            ("yaw_lag", yaw_lag),
            ("yaw_dead_time", yaw_dead_time),
        ):
            if not 0.0 <= value <= _LONGEST:
                raise ValueError(f"{name} must be from 0 to {_LONGEST:g} s, not {value}")
        self._constants = constants
        self._lag, self._yaw_lag = max(lag, _QUICKEST), max(yaw_lag, _QUICKEST)
        self._dead_time, self._yaw_dead_time = dead_time, yaw_dead_time
        self._gain = min(constants.gain, SHARE_OF_LARGEST_GAIN * largest_gain(lag, dead_time))
        self._yaw_gain = min(
            constants.yaw_gain, SHARE_OF_LARGEST_GAIN * largest_gain(yaw_lag, yaw_dead_time)
        )
        critical = 0.25 / constants.gain  # no overshoot, and no quicker than the rate loop
        self._model = ReferenceModel(constants, max(critical, self._lag), self._yaw_lag)
        self._past = History(max(dead_time, yaw_dead_time) + _MOMENT + LONGEST_SAMPLE)
        self._time = 0.0
        self._started = False

    def reset(self, q: Quaternion, body_rates: BodyRates | None = None) -> None:
        """Plan anew from here: after a gap, a change of mode, or a jump of the estimate.

        Args:
            q: attitude.
            body_rates: rad/s; the plan goes on with them. None: at rest.

        Raises:
            InvalidQuaternionError: `q` is not a unit quaternion.
        """
        w, x, y, z = normalised(q)
        square, ax, ay = tilt_products(w, x, y, z)
        north = east = turn_rate = still = 0.0
        if body_rates is not None:
            north, east, turn_rate = rates_to_speed(w, x, y, z, *body_rates)
            still = body_rates[2] - turn_rate
        # What is answered now takes effect one dead time later: the plan begins there.
        c = Coefficients(-2.0 * ay + self._dead_time * north, 2.0 * ax + self._dead_time * east)
        heading = heading_of(sqrt(square), w, z) + self._yaw_dead_time * turn_rate
        model = self._model
        model.place(c, Coefficients(north, east), heading, turn_rate)
        self._time = 0.0
        here = Planned(0.0, model.north, model.east, heading, 0.0)
        motion = Planned(1.0, north, east, turn_rate, still)
        self._past.start(here, motion)
        self._started = True

    def rates(
        self, q: Quaternion, target: Target, dt: float, body_rates: BodyRates | None = None
    ) -> BodyRates:
        """Body rates in rad/s that answer attitude `q`; `dt` is the time since the last sample.

        Raises:
            InvalidQuaternionError: `q` is not a unit quaternion.
            InvalidTargetError: a value of `target` is not finite.
        """
        constants = self._constants
        w, x, y, z = q = normalised(q)
        target = admissible(target, constants.longest_target)
        square, ax, ay = tilt_products(w, x, y, z)
        cosine = 2.0 * square - 1.0
        if cosine < constants.cos_recovery:
            self._started = False
            return BodyRates(*first_order(q, target, dt, constants))
        if not self._started:
            self.reset(q, body_rates)
        dt = min(max(SHORTEST_SAMPLE, dt), LONGEST_SAMPLE)  # in this order NaN is short, too
        heading = heading_of(sqrt(square), w, z)
        north_error, east_error, heading_error = self._errors(-2.0 * ay, 2.0 * ax, heading)
        turn_rate = None
        if body_rates is not None:
            turn_rate = rates_to_speed(w, x, y, z, *body_rates)[2]
        roll, pitch, yaw = self._feed_forward(target, heading, turn_rate, dt)
        more_roll, more_pitch, still = speed_to_rates(
            w,
            z,
            ax,
            ay,
            1.0 / square,
            1.0 / cosine,
            self._gain * east_error,
            -self._gain * north_error,
        )
        return BodyRates(
            *within_limits(
                roll + more_roll,
                pitch + more_pitch,
                yaw + still + self._yaw_gain * heading_error,
                constants.max_tilt_rate,
                constants.max_yaw_rate,
            )
        )

    def _errors(self, north: float, east: float, heading: float) -> tuple[float, float, float]:
        """From what was measured to the plan as it stood one dead time ago.

        During the first dead time after a start nothing planned has had an effect yet.
        """
        north_error = east_error = heading_error = 0.0
        if self._time >= self._dead_time:
            was = self._past.at(self._time - self._dead_time)
            north_error, east_error = was.north - north, was.east - east
        if self._time >= self._yaw_dead_time:
            was = self._past.at(self._time - self._yaw_dead_time)
            heading_error = wrap_angle(was.heading - heading)
        return north_error, east_error, heading_error

    def _feed_forward(
        self, target: Target, heading: float, turn_rate: float | None, dt: float
    ) -> tuple[float, float, float]:
        """Move the plan on by a sample; the rates that follow it there, led by the lags.

        At each end of the sample they are turned into the body at the heading that the vehicle is
        expected to have when they act, so that what turns with the body is led with them.
        """
        model, now = self._model, self._time
        turn_before = model.turn_rate
        x_before, y_before, still_before = self._planned_rates()
        model.advance(target, dt)
        x_after, y_after, still_after = self._planned_rates()
        self._time += dt
        still = self._past.newest.still + 0.5 * (still_before + still_after) * dt
        self._past.add(Planned(self._time, model.north, model.east, model.heading, still))
        change = self._unplanned_turn(turn_rate, now) - self._expected_heading(now)
        first = heading + change + self._expected_heading(now + self._dead_time)
        last = heading + change + self._expected_heading(now + self._dead_time + dt)
        x_before, y_before = into_body(cos(first), sin(first), x_before, y_before)
        x_after, y_after = into_body(cos(last), sin(last), x_after, y_after)
        lead, yaw_lead = self._lag / dt, self._yaw_lag / dt
        return (
            0.5 * (x_before + x_after) + lead * (x_after - x_before),
            0.5 * (y_before + y_after) + lead * (y_after - y_before),
            0.5 * (still_before + still_after + turn_before + model.turn_rate)
            + yaw_lead * (still_after - still_before + model.turn_rate - turn_before),
        )

    def _planned_rates(self) -> tuple[float, float, float]:
        """Rates that go with the plan as it stands, seen from heading 0, rad/s."""
        model = self._model
        return rates_along(model.north, model.east, model.speed_north, model.speed_east)

    def _expected_heading(self, time: float) -> float:
        """Heading by the plan at `time`, but for a constant, rad.

        The turn that is planned comes a yaw dead time late; so does the yaw rate that is to keep
        the heading still, while the tilting that needs it comes a roll-pitch dead time late.
        """
        by_yaw = self._past.at(time - self._yaw_dead_time)
        return by_yaw.heading + by_yaw.still - self._past.at(time - self._dead_time).still

    def _unplanned_turn(self, turn_rate: float | None, now: float) -> float:
        """What the heading will turn beyond the plan until now's answer acts, rad.

        As quickly as it is turning now beyond it; a dead time long, and a lag, for what turns with
        the body has to be led as the rates are.
        """
        if turn_rate is None:
            return 0.0
        planned = self._expected_heading(now + 0.5 * _MOMENT)
        planned -= self._expected_heading(now - 0.5 * _MOMENT)
        return (self._dead_time + self._lag) * (turn_rate - planned / _MOMENT)
