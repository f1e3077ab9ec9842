"""How `model-following` plans the tilt: smooth, on straight lines, within the limits."""

from math import ceil, hypot, inf, radians, sin, sqrt

from companion.attitude.kinematics import speed_to_rates
from companion.attitude.limits import Constants
from companion.attitude.reference import Lag
from companion.attitude.types import Coefficients, Target

_LARGEST_START_NORM = sin(1.4)
"""Largest norm of the coefficients at which the reference starts. Towards norm 1 (90° of tilt) the
body rates grow without bound."""
_LARGEST_RATE_CHANGE = radians(400.0)
"""Largest change of the planned rate v within the lag τ, if the lag is of second order, rad/s.

In PX4's simulation a jump by 270 °/s saturates the motors; 400 °/s spread over τ do not."""
_FOUR_ZETA_SQUARED = 2.7
"""Smallest 4·ζ² of the reference model (ζ: damping ratio), for at most 1 % of overshoot."""
_LARGEST_GAIN_TIMES_STEP = 0.1
"""Largest p·dt of one step of the model; a longer sample is divided into several steps."""
_DIFFERENCE_STEP = 1e-4
"""Time step of the finite differences of rates, s."""


def rates_along(
    north: float, east: float, speed_north: float, speed_east: float
) -> tuple[float, float, float]:
    """Body rates (rad/s) that move the coefficients at this speed (1/s), and hold the heading 0.

    `kinematics.rotate_to_heading` rotates roll and pitch to another heading; yaw is independent of
    the heading.
    """
    cosine = sqrt(1.0 - north * north - east * east)
    a_squared = 0.5 + 0.5 * cosine  # equation 9; at heading 0, a·x and a·y are half coefficients
    return speed_to_rates(
        sqrt(a_squared),
        0.0,
        0.5 * east,
        -0.5 * north,
        1.0 / a_squared,
        1.0 / cosine,
        speed_east,
        -speed_north,
    )


def model_lag(gain: float, lag: float) -> float:
    """τ of `ReferenceModel`, s: lag of the rate loop, but at least 0.25/p (critical damping)."""
    return max(0.25 / gain, lag)


def braking_lead(gain: float, lag: float) -> float:
    """κ of `ReferenceModel`, s: how far ahead the model brakes, to overshoot by 1 % at most.

    The damping of τ·c̈ + (1 + p·κ)·ċ + p·c is then 0.82, or more if κ is 0.
    """
    return max(0.0, sqrt(_FOUR_ZETA_SQUARED * lag / gain) - 1.0 / gain)


def model_response(gain: float, lag: float) -> tuple[float, float]:
    """Gain p' (1/s) and lag τ' (s) of the reference model as τ'·c̈ + ċ = p'·(c_d − c).

    `gain` is p and `lag` is τ of `ReferenceModel`. The model's braking lead κ makes p' smaller than
    p, and τ' smaller than τ.
    """
    braking_factor = 1.0 + gain * braking_lead(gain, lag)
    return gain / braking_factor, lag / braking_factor


class ReferenceModel:
    """The reference of the tilt: σ·c⃛ + τ·c̈ + ċ = v with v = p·(c_d − c − κ·ċ), limited.

    The whole vector v is scaled, so a step moves on a straight line. The scale keeps the body rates
    of the motion within the limits. The rates that are sent compensate the lag of the vehicle
    (τ and σ) and stay within the limits too. If the autopilot has a slew limit, v changes no faster
    than this limit, and is bounded so that it can fall to 0 at the target. If the lag is of second
    order, a large step of v would saturate the motors, and the response would not be linear. In
    that case, if the body rates are limited, v changes by at most `_LARGEST_RATE_CHANGE` within τ.

    Args:
        lag: τ, s.
        acceleration: slew limit of the autopilot, rad/s².
        sigma: σ, s²; 0 if the lag of the vehicle is of first order.

    Attributes:
        north, east: coefficients of the reference.
        speed_north, speed_east: speed of the coefficients, 1/s.
    """

    def __init__(
        self, constants: Constants, lag: float, acceleration: float = inf, sigma: float = 0.0
    ) -> None:
        self._slew_limit, self._sigma = acceleration, sigma
        self.retune(constants, lag)
        self.start_at(Coefficients(0.0, 0.0), Coefficients(0.0, 0.0))

    def retune(self, constants: Constants, lag: float) -> None:
        """Use other gains and limits, and the `model_lag` (s) for them; the motion continues."""
        self._constants = constants
        self._braking_lead = braking_lead(constants.gain, lag)
        self._lag = Lag(lag, self._sigma)
        self._acceleration = self._slew_limit
        if self._sigma > 0.0 and constants.max_tilt_rate < inf:
            self._acceleration = min(self._slew_limit, _LARGEST_RATE_CHANGE / lag)
        # Near the target v falls by p·v per second, which must stay within the slew limit.
        largest_v = self._acceleration / constants.gain
        self._tilt_rate_weight = max(constants.tilt_rate_weight, largest_v**-2)

    def start_at(self, c: Coefficients, speed: Coefficients) -> None:
        """Start at `c`, shortened to the norm `_LARGEST_START_NORM` at most, with `speed` (1/s)."""
        norm = hypot(c.north, c.east)
        scale = _LARGEST_START_NORM / norm if norm > _LARGEST_START_NORM else 1.0
        self.north, self.east = scale * c.north, scale * c.east
        self.speed_north, self.speed_east = self._v_north, self._v_east = speed
        self._slope_north = self._slope_east = 0.0

    def rates(self) -> tuple[float, float, float]:
        """Body rates of the reference now, at heading 0, rad/s."""
        return rates_along(self.north, self.east, self.speed_north, self.speed_east)

    def rate_slopes(self, roll: float, pitch: float) -> tuple[float, float]:
        """Derivatives of the roll and pitch rate of `rates`, rad/s², by finite differences.

        Args:
            roll: roll rate of `rates` now, rad/s.
            pitch: pitch rate of `rates` now, rad/s.
        """
        later_roll, later_pitch, _ = rates_along(
            self.north + _DIFFERENCE_STEP * self.speed_north,
            self.east + _DIFFERENCE_STEP * self.speed_east,
            self.speed_north + _DIFFERENCE_STEP * self._slope_north,
            self.speed_east + _DIFFERENCE_STEP * self._slope_east,
        )
        return (later_roll - roll) / _DIFFERENCE_STEP, (later_pitch - pitch) / _DIFFERENCE_STEP

    def advance(self, target: Target, dt: float) -> None:
        """Advance by `dt` seconds towards a target that `limited_target` has limited."""
        step_count = ceil(dt * self._constants.gain / _LARGEST_GAIN_TIMES_STEP)
        for _ in range(step_count):
            self._step(target, dt / step_count)

    def _step(self, target: Target, dt: float) -> None:
        north, east = self.north, self.east
        self._choose_v(target, dt)
        lag = self._lag
        north_change, self.speed_north, self._slope_north = lag.after(
            self.speed_north, self._slope_north, self._v_north, dt
        )
        self.north += north_change
        east_change, self.speed_east, self._slope_east = lag.after(
            self.speed_east, self._slope_east, self._v_east, dt
        )
        self.east += east_change
        self._limit_tilt(north, east, dt)

    def _choose_v(self, target: Target, dt: float) -> None:
        """Choose v for the next step from the motion predicted for the middle of the step."""
        constants = self._constants
        lead, slope_factor = 0.5 * dt + self._braking_lead, 0.5 * dt * self._braking_lead
        north = self.north + lead * self.speed_north + slope_factor * self._slope_north
        east = self.east + lead * self.speed_east + slope_factor * self._slope_east
        v_north = constants.gain * (target.north - north)
        v_east = constants.gain * (target.east - east)
        roll, pitch, _ = rates_along(self.north, self.east, v_north, v_east)
        excess = self._tilt_rate_weight * (roll * roll + pitch * pitch)
        excess = max(excess, constants.speed_weight * (v_north * v_north + v_east * v_east))
        if excess > 1.0:
            scale = 1.0 / sqrt(excess)
            v_north *= scale
            v_east *= scale
        if self._acceleration < inf:
            change_north, change_east = v_north - self._v_north, v_east - self._v_east
            roll, pitch, _ = rates_along(self.north, self.east, change_north, change_east)
            allowed_share = self._acceleration * dt / max(hypot(roll, pitch), 1e-12)
            if allowed_share < 1.0:
                v_north = self._v_north + allowed_share * change_north
                v_east = self._v_east + allowed_share * change_east
        self._v_north, self._v_east = v_north, v_east

    def _limit_tilt(self, north: float, east: float, dt: float) -> None:
        """Limit the coefficients after a step to the largest tilt, or to the tilt before the step.

        Args:
            north: coefficient before the step, north.
            east: coefficient before the step, east.
            dt: duration of the step, s.
        """
        length = hypot(self.north, self.east)
        if length <= self._constants.max_target_norm:
            return
        max_norm = max(self._constants.max_target_norm, hypot(north, east))
        if length > max_norm:
            self.north *= max_norm / length
            self.east *= max_norm / length
            self.speed_north = (self.north - north) / dt
            self.speed_east = (self.east - east) / dt
            self._slope_north = self._slope_east = 0.0
