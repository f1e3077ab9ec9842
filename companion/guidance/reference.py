"""Types of guidance: world NED, SI units, radians; headings are tilt-yaw headings."""

from collections.abc import Callable, Sequence
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
    """Position (m) and heading (rad) that is held, or from which a maneuver begins."""

    position_ned: Vector
    heading: float


class VehicleMotion(NamedTuple):
    """Position in m and velocity in m/s of the vehicle."""

    position_ned: Vector
    velocity_ned: Vector


class Reference(NamedTuple):
    """What the vehicle should do at one instant; NED, m, m/s, m/s², rad.

    `coefficients` or `body_rates` command the horizontal motion in open loop. Position and velocity
    are then used for the height only.

    Attributes:
        coefficients: acceleration coefficients in open loop; None: closed loop.
        body_rates: body rates in open loop, rad/s; they command the heading, too.
        thrust_steps: whether the vertical acceleration jumps.
        drifting: whether the horizontal feedback pauses; drag and disturbance stay compensated.
        from_rest: whether the mean target coefficients of the latest pause (`drifting`) are added
            to `coefficients`, to balance wind and the error of the estimated attitude.
        holds_height: False: `acceleration_ned` is commanded vertically without feedback.
        thrust: normalised thrust that replaces the one guidance computes, 0..1.
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
    from_rest: bool = False
    holds_height: bool = True
    thrust: float | None = None

    @property
    def closed_loop(self) -> bool:
        """Whether the horizontal motion is in closed loop: no coefficients or body rates given."""
        return self.coefficients is None and self.body_rates is None

    @property
    def holds_position(self) -> bool:
        """Whether guidance corrects the horizontal position: in closed loop and not drifting."""
        return self.closed_loop and not self.drifting

    @property
    def thrust_is_steady(self) -> bool:
        """Whether the thrust changes slowly enough for the rotors.

        False in the doublets of `identify`, and where body rates or the thrust are commanded.
        """
        return not self.thrust_steps and self.body_rates is None and self.thrust is None


ReferenceAt = Callable[[float], Reference]
"""The reference as a function of event-loop time, s."""


Horizontal = tuple[float, float]
"""A horizontal vector: (north, east)."""


def minus(left: Vector, right: Vector) -> Vector:
    """The vector `left` − `right`."""
    return left[0] - right[0], left[1] - right[1], left[2] - right[2]


def limited(north: float, east: float, most: float) -> Horizontal:
    """The vector, shortened to `most` if it is longer; its direction is kept."""
    length = hypot(north, east)
    if length <= most:
        return north, east
    return north * most / length, east * most / length


def rotated(north: float, east: float, angle: float) -> Horizontal:
    """The vector rotated clockwise, seen from above, by `angle` in rad."""
    c, s = cos(angle), sin(angle)
    return c * north - s * east, s * north + c * east


def change_rate(
    old: Sequence[float], new: Sequence[float], since: float, most: float
) -> tuple[float, ...] | None:
    """Rate of change of a commanded vector; None if it has jumped.

    Args:
        old: components in the previous command.
        new: components in the present command.
        since: time between the two commands, s.
        most: largest rate of change that does not count as a jump.
    """
    rate = tuple((b - a) / since for a, b in zip(old, new, strict=True))
    return rate if hypot(*rate) <= most else None
