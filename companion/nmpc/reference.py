"""The reference of the horizon: attitude and thrust that keep the vehicle on its trajectory."""

from math import sqrt
from typing import NamedTuple

from companion.attitude import wrap_angle
from companion.drag import AxisDrag, Drag
from companion.guidance.trajectory.sample import Sample, Vector

_MIN_UPWARD_THRUST_SHARE = 0.2
"""Smallest upward part of the reference thrust, as a share of gravity."""


class Node(NamedTuple):
    """The reference at one node of the horizon."""

    position: Vector
    """Position, m, NED."""
    velocity: Vector
    """Velocity, m/s, NED."""
    north: float
    east: float
    """`north` and `east`: acceleration coefficients (horizontal part of the thrust axis)."""
    speed_north: float
    speed_east: float
    """`speed_north` and `speed_east`: time derivative of the coefficients, 1/s."""
    thrust: float
    """Specific thrust, m/s²."""
    heading: float
    """Tilt-yaw heading, rad; unwrapped, so that it does not jump between nodes."""
    heading_rate: float
    """Time derivative of the heading, rad/s."""


class Start(NamedTuple):
    """Start position of a trajectory, and the angle added to the headings of its samples."""

    position: Vector
    """Position at which the trajectory begins, m, NED; added to the positions of its samples."""
    heading_offset: float = 0.0
    """Angle added to the headings of the trajectory, rad: the sum of the heading resets. If the
    trajectory holds the heading at its start, that heading is also added. Positions are not
    rotated."""


def node_of(
    sample: Sample,
    start: Start,
    nearby_heading: float,
    drag: Drag,
    axis_drag: float,
    gravity: float,
    disturbance: Vector,
) -> Node:
    """The node of a sample of the trajectory: differential flatness of a point mass with drag.

    The rotors must provide the specific force f = a + d − w − g: acceleration a of the sample,
    deceleration d by drag, disturbance w, gravity g. The upward part of f is limited to at least a
    fifth of gravity. |f| is the specific thrust. The horizontal part of f/|f| is the coefficients,
    and ḟ = jerk + ḋ gives their time derivative.

    Args:
        sample: sample of the trajectory.
        start: start of the trajectory.
        nearby_heading: a heading, rad; the node's heading is unwrapped to within π of it.
        drag: drag of the vehicle.
        axis_drag: coefficient of `AxisDrag`, 1/m.
        gravity: gravity, m/s².
        disturbance: w, acceleration by wind and other unmodelled forces, m/s².
    """
    velocity, acceleration, jerk = sample.velocity, sample.acceleration, sample.jerk
    d, d_rate = drag.deceleration(velocity), drag.deceleration_rate(velocity, acceleration)
    heading = nearby_heading + wrap_angle(start.heading_offset + sample.heading - nearby_heading)
    axes = AxisDrag(axis_drag, heading)
    axis_d = *axes.deceleration(*velocity[:2]), 0.0
    heading_rate = sample.heading_rate
    axis_d_rate = *axes.deceleration_rate(velocity[:2], acceleration[:2], heading_rate), 0.0
    f_n, f_e, f_d = (acceleration[i] + d[i] + axis_d[i] - disturbance[i] for i in range(3))
    f_d = min(f_d - gravity, -_MIN_UPWARD_THRUST_SHARE * gravity)
    rate_n, rate_e, rate_d = (jerk[i] + d_rate[i] + axis_d_rate[i] for i in range(3))
    thrust = sqrt(f_n * f_n + f_e * f_e + f_d * f_d)
    thrust_rate = (f_n * rate_n + f_e * rate_e + f_d * rate_d) / thrust
    north, east = f_n / thrust, f_e / thrust
    p_n, p_e, p_d = (start.position[i] + sample.position[i] for i in range(3))
    return Node(
        (p_n, p_e, p_d),
        velocity,
        north,
        east,
        (rate_n - north * thrust_rate) / thrust,
        (rate_e - east * thrust_rate) / thrust,
        thrust,
        heading,
        sample.heading_rate,
    )
