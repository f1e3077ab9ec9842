"""The straight path of `Vehicle.go_to`."""

from dataclasses import replace
from math import hypot, tau

from companion.config import Config
from companion.guidance.finite import finite_number
from companion.guidance.reference import Vector
from companion.guidance.trajectory import Hover, Trajectory, line
from companion.guidance.trajectory.sample import SMALLEST_DISTANCE
from companion.guidance.trajectory.timed_curve import FixedHeading

_USUAL_SPEED = 2.0
"""Speed if the program gives none, m/s."""


def straight_path(
    config: Config,
    displacement_ned: Vector,
    heading: float | None,
    speed: float | None,
    acceleration: float,
    jerk: float,
) -> Trajectory:
    """A straight line, from rest to rest; for a distance of nearly 0, a hover.

    `displacement_ned`: end of the line relative to its start, m. Without a `speed`, the limits in
    `config` bound the speed. The other arguments are those of `Vehicle.go_to`.

    Raises:
        TrajectoryError: a limit is not positive.
        ValueError: an argument is not finite, or the heading exceeds two turns.
    """
    if speed is None:
        speed = _usual_speed(displacement_ned, config)
    names = "speed", "acceleration", "jerk"
    speed, acceleration, jerk = map(finite_number, names, (speed, acceleration, jerk))
    if heading is not None:
        heading = finite_number("heading", heading)
        if abs(heading) > 2.0 * tau:
            raise ValueError(f"heading is in rad, and {heading:g} rad are more than two turns")
    if hypot(*displacement_ned) < SMALLEST_DISTANCE:
        return Hover(0.0, heading=heading)
    path = line(displacement_ned, speed, acceleration, jerk)
    return path if heading is None else replace(path, heading=FixedHeading(heading))


def _usual_speed(displacement_ned: Vector, config: Config) -> float:
    """Speed of a line to `displacement_ned` (m NED from its start), m/s: at most `_USUAL_SPEED`."""
    speed = min(_USUAL_SPEED, config.safety.max_speed_m_s)
    if displacement_ned[2] == 0.0:
        return speed
    max_vertical_speed = (
        config.limits.max_climb_m_s if displacement_ned[2] < 0.0 else config.limits.max_descent_m_s
    )
    return min(speed, max_vertical_speed * hypot(*displacement_ned) / abs(displacement_ned[2]))
