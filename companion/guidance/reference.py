"""The words of guidance. World NED, SI units, radians; headings are tilt-yaw headings."""

from math import cos, hypot, sin
from typing import NamedTuple

from companion.attitude import BodyRates, Coefficients

Vector = tuple[float, float, float]
"""(north, east, down)."""

GRAVITY = 9.80665
"""Standard gravity, m/s²."""


class Pose(NamedTuple):
    """Where a maneuver begins."""

    position_ned: Vector
    heading: float


class VehicleMotion(NamedTuple):
    """What guidance knows of the vehicle: position in m and velocity in m/s."""

    position_ned: Vector
    velocity_ned: Vector


class Reference(NamedTuple):
    """Where the vehicle ought to be at one instant.

    With `coefficients` given, the horizontal acceleration is commanded open loop, and position and
    velocity count for the height only. With `body_rates` given the same holds of these. `drifting`
    pauses the horizontal feedback: only what holds against the wind is asked for.
    """

    position_ned: Vector
    velocity_ned: Vector = (0.0, 0.0, 0.0)
    acceleration_ned: Vector = (0.0, 0.0, 0.0)
    heading: float = 0.0
    heading_rate: float = 0.0
    coefficients: Coefficients | None = None
    body_rates: BodyRates | None = None
    thrust_steps: bool = False
    drifting: bool = False

    @property
    def closed_loop(self) -> bool:
        """Whether guidance says which acceleration it takes, and nobody else does."""
        return self.coefficients is None and self.body_rates is None

    @property
    def position_is_meant(self) -> bool:
        """Whether the horizontal position is meant, and not only the height."""
        return self.closed_loop and not self.drifting

    @property
    def height_is_steady(self) -> bool:
        """Whether thrust changes no faster than the rotors follow: in no doublet."""
        return not self.thrust_steps and self.body_rates is None


Horizontal = tuple[float, float]
"""(north, east)."""


def limited(north: float, east: float, most: float) -> Horizontal:
    """The vector, shortened along its direction where it is longer than `most`."""
    length = hypot(north, east)
    if length <= most:
        return north, east
    return north * most / length, east * most / length


def rotated(north: float, east: float, angle: float) -> Horizontal:
    """The vector turned clockwise, seen from above, by an angle in rad."""
    c, s = cos(angle), sin(angle)
    return c * north - s * east, s * north + c * east
