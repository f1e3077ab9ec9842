"""Data types of guidance: world NED, SI units, radians; headings are tilt-yaw headings."""

from collections.abc import Callable, Sequence
from enum import Enum, auto
from math import cos, hypot, sin
from typing import NamedTuple

from companion.attitude import BodyRates, Coefficients

Vector = tuple[float, float, float]
"""A vector in the world frame: (north, east, down)."""

GRAVITY = 9.80665
"""Standard gravity, m/s²."""

LARGEST_JERK = 50.0
"""Largest jerk of a commanded acceleration, m/s³; a faster change counts as a step."""


class Pose(NamedTuple):
    """Position (m NED) and heading (rad) that is held, or from which a maneuver begins."""

    position_ned: Vector
    heading: float


class VehicleMotion(NamedTuple):
    """Position (m NED) and velocity (m/s NED) of the vehicle."""

    position_ned: Vector
    velocity_ned: Vector


class HorizontalMode(Enum):
    """How guidance follows the horizontal part of a reference in closed loop.

    Attributes:
        POSITION: guidance corrects errors of position, velocity and acceleration.
        ACCELERATION: guidance commands the acceleration alone. Position and velocity are not
            corrected; drag at the reference's velocity and the disturbance are compensated.
    """

    POSITION = auto()
    ACCELERATION = auto()


class TiltCommand(NamedTuple):
    """Acceleration coefficients in open loop: they become the target of the planner.

    Attributes:
        coefficients: north and east; the sine of the tilt is their length.
        trimmed: whether guidance adds the trim (`linear.Trim`), which balances wind and the error
            of the estimated attitude.
    """

    coefficients: Coefficients
    trimmed: bool = False


HorizontalCommand = HorizontalMode | TiltCommand | BodyRates
"""Closed loop, a tilt in open loop, or body rates in open loop (rad/s)."""


class VerticalMode(Enum):
    """How guidance follows the vertical part of a reference.

    Attributes:
        HEIGHT: guidance corrects errors of height and climb rate.
        HEIGHT_IN_STEPS: as HEIGHT, but the vertical acceleration jumps. The rotors do not follow
            jumps, so the hover thrust is not learned in this mode.
        ACCELERATION: guidance commands the acceleration alone, without drag and feedback.
    """

    HEIGHT = auto()
    HEIGHT_IN_STEPS = auto()
    ACCELERATION = auto()


class ThrustCommand(NamedTuple):
    """Normalised thrust that replaces the thrust that guidance computes.

    Guidance still computes the vertical acceleration as in `VerticalMode.HEIGHT`.

    Attributes:
        thrust: normalised thrust, 0..1.
    """

    thrust: float


VerticalCommand = VerticalMode | ThrustCommand


class Reference(NamedTuple):
    """What the vehicle should do at one instant; NED, m, m/s, m/s², rad.

    Attributes:
        position_ned: position in m; only its height counts if `horizontal` is in open loop.
        velocity_ned: velocity in m/s.
        acceleration_ned: acceleration in m/s².
        heading: heading in rad.
        heading_rate: derivative of the heading in rad/s.
        horizontal: how the horizontal motion is commanded: in closed loop by position or by
            acceleration; in open loop by tilt or by body rates in rad/s, which command the
            heading, too.
        vertical: how the vertical motion is commanded.
    """

    position_ned: Vector
    velocity_ned: Vector = (0.0, 0.0, 0.0)
    acceleration_ned: Vector = (0.0, 0.0, 0.0)
    heading: float = 0.0
    heading_rate: float = 0.0
    horizontal: HorizontalCommand = HorizontalMode.POSITION
    vertical: VerticalCommand = VerticalMode.HEIGHT

    @property
    def coefficients(self) -> Coefficients | None:
        """The acceleration coefficients that are commanded in open loop; None: none are."""
        return self.horizontal.coefficients if isinstance(self.horizontal, TiltCommand) else None

    @property
    def body_rates(self) -> BodyRates | None:
        """The body rates that are commanded in open loop, rad/s; None: none are."""
        return self.horizontal if isinstance(self.horizontal, BodyRates) else None

    @property
    def thrust(self) -> float | None:
        """The normalised thrust that is commanded, 0..1; None: guidance computes it."""
        return self.vertical.thrust if isinstance(self.vertical, ThrustCommand) else None

    @property
    def closed_loop(self) -> bool:
        """Whether the horizontal motion is in closed loop: no tilt and no body rates."""
        return isinstance(self.horizontal, HorizontalMode)

    @property
    def holds_position(self) -> bool:
        """Whether guidance corrects the horizontal position."""
        return self.horizontal is HorizontalMode.POSITION

    @property
    def holds_height(self) -> bool:
        """Whether the vehicle should be at the height of the reference."""
        return self.vertical in (VerticalMode.HEIGHT, VerticalMode.HEIGHT_IN_STEPS)

    @property
    def thrust_is_steady(self) -> bool:
        """Whether the thrust changes slowly enough for the rotors.

        False in the doublets of `identify`, and where body rates or the thrust are commanded.
        """
        steady = self.vertical in (VerticalMode.HEIGHT, VerticalMode.ACCELERATION)
        return steady and not isinstance(self.horizontal, BodyRates)


ReferenceAt = Callable[[float], Reference]
"""The reference as a function of event-loop time, s."""


NorthEast = tuple[float, float]
"""A horizontal vector: (north, east)."""


def minus(left: Vector, right: Vector) -> Vector:
    """The vector `left` − `right`."""
    return left[0] - right[0], left[1] - right[1], left[2] - right[2]


def clamp_length(north: float, east: float, largest: float) -> NorthEast:
    """The vector, shortened to the length `largest` if it is longer; its direction is kept."""
    length = hypot(north, east)
    if length <= largest:
        return north, east
    return north * largest / length, east * largest / length


def rotate(north: float, east: float, angle: float) -> NorthEast:
    """The vector rotated clockwise, seen from above, by `angle` in rad."""
    c, s = cos(angle), sin(angle)
    return c * north - s * east, s * north + c * east


def change_rate(
    old: Sequence[float], new: Sequence[float], dt: float, largest: float
) -> tuple[float, ...] | None:
    """Rate of change of a commanded vector; None if it has jumped.

    Args:
        old: components in the previous command.
        new: components in the present command.
        dt: time between the two commands, s.
        largest: largest rate of change that does not count as a jump.
    """
    rate = tuple((b - a) / dt for a, b in zip(old, new, strict=True))
    return rate if hypot(*rate) <= largest else None
