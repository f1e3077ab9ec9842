"""The motion that `model-following` plans: second order, on straight lines, within the limits."""

from math import exp, hypot, sin, sqrt

from companion.attitude.constants import Constants
from companion.attitude.kinematics import speed_to_rates, tilt_products
from companion.attitude.reference import SecondOrderReference
from companion.attitude.representation import wrap_angle
from companion.attitude.rotation import attitude_of, within
from companion.attitude.types import Coefficients, Target

_FURTHEST = sin(1.4)
"""No reference is longer: an attitude has to have it, and its rates have to be finite."""


def rates_along(
    north: float, east: float, speed_north: float, speed_east: float
) -> tuple[float, float, float]:
    """Body rates (rad/s) that move these coefficients at this speed (1/s) at heading 0, kept still.

    `kinematics.into_body` turns the first two to another heading; the third is the same at all.
    """
    w, x, y, z = attitude_of(north, east, 0.0)
    square, ax, ay = tilt_products(w, x, y, z)
    return speed_to_rates(
        w, z, ax, ay, 1.0 / square, 1.0 / (2.0 * square - 1.0), speed_east, -speed_north
    )


class ReferenceModel:
    """c̈ = (v − ċ)/τ with v = p·(c_d − c) limited, and the heading likewise with its own τ.

    v is scaled as a whole, so a step moves on a straight line. It is limited such that the body
    rates that go with it stay within the limits; and since ċ + τ·c̈ = v, so does what is commanded,
    led by the lag, where τ is the vehicle's.

    Args:
        constants: gains and limits.
        lag: τ of the coefficients, s.
        yaw_lag: τ of the heading, s.

    Attributes:
        north, east: coefficients of the reference.
        speed_north, speed_east: their speed, 1/s.
        heading: rad, not wrapped.
        turn_rate: its speed, rad/s.
    """

    __slots__ = (
        "_constants",
        "_free",
        "_lag",
        "_yaw_lag",
        "east",
        "heading",
        "north",
        "speed_east",
        "speed_north",
        "turn_rate",
    )

    def __init__(self, constants: Constants, lag: float, yaw_lag: float) -> None:
        self._constants = constants
        self._free = SecondOrderReference.with_lag(constants.gain, lag)
        self._lag = lag
        self._yaw_lag = yaw_lag
        self.north = self.east = self.speed_north = self.speed_east = 0.0
        self.heading = self.turn_rate = 0.0

    def place(self, c: Coefficients, speed: Coefficients, heading: float, turn_rate: float) -> None:
        """Start with these coefficients, their speed (1/s), heading (rad) and its speed (rad/s)."""
        length = hypot(c.north, c.east)
        scale = _FURTHEST / length if length > _FURTHEST else 1.0
        self.north, self.east = scale * c.north, scale * c.east
        self.speed_north, self.speed_east = speed
        self.heading, self.turn_rate = heading, turn_rate

    def advance(self, target: Target, dt: float) -> None:
        """Move on by `dt` seconds towards an admissible target."""
        north, east = self.north, self.east
        v_north, v_east = self._demand(target)
        if v_north == self._constants.gain * (target.north - north):
            (self.north, self.east), (self.speed_north, self.speed_east) = self._free.after(
                Coefficients(north, east),
                Coefficients(self.speed_north, self.speed_east),
                Coefficients(target.north, target.east),
                dt,
            )
        else:
            self._follow(v_north, v_east, dt)
        self._stay_inside(north, east, dt)
        v = self._constants.yaw_gain * wrap_angle(target.heading - self.heading)
        v = within(v + target.heading_rate, self._constants.max_yaw_rate)
        kept = exp(-dt / self._yaw_lag)
        self.heading += v * dt + (self.turn_rate - v) * self._yaw_lag * (1.0 - kept)
        self.turn_rate = v + (self.turn_rate - v) * kept

    def _demand(self, target: Target) -> tuple[float, float]:
        """V = p·(c_d − c), scaled to the limits."""
        constants = self._constants
        v_north = constants.gain * (target.north - self.north)
        v_east = constants.gain * (target.east - self.east)
        roll, pitch, _ = rates_along(self.north, self.east, v_north, v_east)
        excess = constants.tilt_rate_weight * (roll * roll + pitch * pitch)
        excess = max(excess, constants.speed_weight * (v_north * v_north + v_east * v_east))
        scale = 1.0 / sqrt(excess) if excess > 1.0 else 1.0
        return scale * v_north, scale * v_east

    def _follow(self, v_north: float, v_east: float, dt: float) -> None:
        """Exact over the sample with v held."""
        kept = exp(-dt / self._lag)
        drift = self._lag * (1.0 - kept)
        self.north += v_north * dt + (self.speed_north - v_north) * drift
        self.east += v_east * dt + (self.speed_east - v_east) * drift
        self.speed_north = v_north + (self.speed_north - v_north) * kept
        self.speed_east = v_east + (self.speed_east - v_east) * kept

    def _stay_inside(self, north: float, east: float, dt: float) -> None:
        """Not beyond the largest tilt, or no further beyond it than (north, east) was."""
        longest = max(self._constants.longest_target, hypot(north, east))
        length = hypot(self.north, self.east)
        if length > longest:
            self.north *= longest / length
            self.east *= longest / length
            self.speed_north = (self.north - north) / dt
            self.speed_east = (self.east - east) / dt
