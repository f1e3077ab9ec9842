"""How `model-following` plans the tilt: second order, on straight lines, within the limits."""

from math import hypot, inf, sin, sqrt

from companion.attitude.constants import Constants
from companion.attitude.kinematics import speed_to_rates
from companion.attitude.lag import behind
from companion.attitude.reference import SecondOrderReference
from companion.attitude.types import Coefficients, Target

_FURTHEST = sin(1.4)
"""No reference is longer: an attitude has to have it, and its rates have to be finite."""


def rates_along(
    north: float, east: float, speed_north: float, speed_east: float
) -> tuple[float, float, float]:
    """Body rates (rad/s) that move these coefficients at this speed (1/s) at heading 0, kept still.

    `kinematics.into_body` turns the first two to another heading; the third is the same at all.
    """
    cosine = sqrt(1.0 - north * north - east * east)
    square = 0.5 + 0.5 * cosine  # a² of equation 9; at heading 0, a·x and a·y are half coefficients
    return speed_to_rates(
        sqrt(square),
        0.0,
        0.5 * east,
        -0.5 * north,
        1.0 / square,
        1.0 / cosine,
        speed_east,
        -speed_north,
    )


def model_lag(gain: float, lag: float) -> float:
    """τ of the model for a gain p (1/s), s: no overshoot, and no quicker than the rate loop."""
    return max(0.25 / gain, lag)


class ReferenceModel:
    """c̈ = (v − ċ)/τ with v = p·(c_d − c), limited.

    v is scaled as a whole, so a step moves on a straight line. It is limited such that the body
    rates that go with it stay within the limits; and since ċ + τ·c̈ = v, so does what is commanded,
    led by the lag, where τ is at least the vehicle's. Where the autopilot limits the acceleration
    of the rates it aims at, v changes no faster than that, and is never more than can be slowed
    down in time: so the autopilot's limit is never felt.

    Args:
        constants: gains and limits.
        lag: τ, s.
        acceleration: the autopilot's limit, rad/s².

    Attributes:
        north, east: coefficients of the reference.
        speed_north, speed_east: their speed, 1/s.
    """

    __slots__ = (
        "_acceleration",
        "_constants",
        "_free",
        "_lag",
        "_tilt_rate_weight",
        "_v_east",
        "_v_north",
        "east",
        "north",
        "speed_east",
        "speed_north",
    )

    def __init__(self, constants: Constants, lag: float, acceleration: float = inf) -> None:
        self._constants = constants
        self._free = SecondOrderReference.with_lag(constants.gain, lag)
        self._lag = lag
        self._acceleration = acceleration
        # Near the target v falls by p·v a second.
        slowed_in_time = acceleration / constants.gain
        self._tilt_rate_weight = max(constants.tilt_rate_weight, slowed_in_time**-2)
        self.place(Coefficients(0.0, 0.0), Coefficients(0.0, 0.0))

    def place(self, c: Coefficients, speed: Coefficients) -> None:
        """Start with these coefficients and their speed (1/s)."""
        length = hypot(c.north, c.east)
        scale = _FURTHEST / length if length > _FURTHEST else 1.0
        self.north, self.east = scale * c.north, scale * c.east
        self.speed_north, self.speed_east = self._v_north, self._v_east = speed

    def rates(self) -> tuple[float, float, float]:
        """Body rates that go with the reference as it stands, at heading 0, rad/s."""
        return rates_along(self.north, self.east, self.speed_north, self.speed_east)

    def advance(self, target: Target, dt: float) -> None:
        """Move on by `dt` seconds towards an admissible target."""
        north, east = self.north, self.east
        if self._aim(target, dt):
            self._follow(dt)
        else:
            (self.north, self.east), (self.speed_north, self.speed_east) = self._free.after(
                Coefficients(north, east),
                Coefficients(self.speed_north, self.speed_east),
                Coefficients(target.north, target.east),
                dt,
            )
        self._stay_inside(north, east, dt)

    def _aim(self, target: Target, dt: float) -> bool:
        """Choose v for the coming sample; whether a limit shaped it."""
        constants = self._constants
        v_north = constants.gain * (target.north - self.north)
        v_east = constants.gain * (target.east - self.east)
        roll, pitch, _ = rates_along(self.north, self.east, v_north, v_east)
        excess = self._tilt_rate_weight * (roll * roll + pitch * pitch)
        excess = max(excess, constants.speed_weight * (v_north * v_north + v_east * v_east))
        limited = excess > 1.0
        if limited:
            scale = 1.0 / sqrt(excess)
            v_north *= scale
            v_east *= scale
        if self._acceleration < inf:
            more_north, more_east = v_north - self._v_north, v_east - self._v_east
            roll, pitch, _ = rates_along(self.north, self.east, more_north, more_east)
            share = self._acceleration * dt / max(hypot(roll, pitch), 1e-12)
            if share < 1.0:
                limited = True
                v_north = self._v_north + share * more_north
                v_east = self._v_east + share * more_east
        self._v_north, self._v_east = v_north, v_east
        return limited

    def _follow(self, dt: float) -> None:
        """Exact over the sample with v held."""
        moved, self.speed_north = behind(self.speed_north, self._v_north, self._lag, dt)
        self.north += moved
        moved, self.speed_east = behind(self.speed_east, self._v_east, self._lag, dt)
        self.east += moved

    def _stay_inside(self, north: float, east: float, dt: float) -> None:
        """Not beyond the largest tilt, or no further beyond it than (north, east) was."""
        length = hypot(self.north, self.east)
        if length <= self._constants.longest_target:
            return
        longest = max(self._constants.longest_target, hypot(north, east))
        if length > longest:
            self.north *= longest / length
            self.east *= longest / length
            self.speed_north = (self.north - north) / dt
            self.speed_east = (self.east - east) / dt
