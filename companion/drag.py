"""Drag per mass: a part that is the same in all directions, and one along the body's axes."""

from math import cos, pi, sin
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

Number = TypeVar("Number", float, NDArray[np.float64])
"""Type of a vector component: float or array; CasADi symbols work as well."""

_SPEED_SQUARED_MARGIN = 1e-12
"""Added to the squared speed, (m/s)², so that the speed is differentiable at rest."""


class Drag(NamedTuple):
    """Deceleration = (linear + quadratic·|v|)·v, where v is the airspeed vector.

    Attributes:
        linear: linear drag per mass, 1/s.
        quadratic: quadratic drag per mass, 1/m.
    """

    linear: float = 0.0
    quadratic: float = 0.0

    def per_velocity(self, speed: float) -> float:
        """Deceleration divided by speed, 1/s, at a speed in m/s."""
        return self.linear + self.quadratic * speed

    def deceleration(
        self, velocity: tuple[Number, Number, Number]
    ) -> tuple[Number, Number, Number]:
        """Deceleration vector, m/s², parallel to the airspeed vector `velocity`, m/s."""
        north, east, down = velocity
        per_velocity = self.linear + self.quadratic * _smooth_speed(velocity)
        return per_velocity * north, per_velocity * east, per_velocity * down

    def deceleration_rate(
        self, velocity: tuple[Number, Number, Number], acceleration: tuple[Number, Number, Number]
    ) -> tuple[Number, Number, Number]:
        """Time derivative of `deceleration`, m/s³; `velocity` is the airspeed, m/s."""
        speed = _smooth_speed(velocity)
        per_velocity = self.linear + self.quadratic * speed
        north, east, down = velocity
        a_north, a_east, a_down = acceleration
        per_velocity_rate = (
            self.quadratic * (north * a_north + east * a_east + down * a_down) / speed
        )
        return (
            per_velocity * a_north + per_velocity_rate * north,
            per_velocity * a_east + per_velocity_rate * east,
            per_velocity * a_down + per_velocity_rate * down,
        )


NO_DRAG = Drag()

_MEAN_CUBE_SUM = 8.0 / (3.0 * pi)
"""Mean of |cos φ|³ + |sin φ|³ over all angles φ between airspeed and forward axis. Quadratic drag
along two body axes decelerates along the airspeed by coefficient·|v|² times this sum.
"""


class AxisDrag(NamedTuple):
    """The part of the quadratic drag that depends on the direction of flight.

    Along each horizontal body axis i the drag is coefficient·|v_i|·v_i, as in PX4's model of bluff
    body drag. The mean over all directions of flight, 0.85·coefficient·|v|·v_i, belongs to
    `Drag.quadratic`; the rest decelerates by coefficient·(|v_i| − 0.85·|v|)·v_i.

    Attributes:
        coefficient: quadratic drag along an axis per mass, 1/m; 0 for a round body.
        heading: heading of the body's forward axis, rad.
    """

    coefficient: float = 0.0
    heading: float = 0.0

    def deceleration(self, north: float, east: float) -> tuple[float, float]:
        """Deceleration north and east, m/s², at the airspeed (`north`, `east`), m/s."""
        if self.coefficient == 0.0:
            return 0.0, 0.0
        return axis_drag_deceleration(
            self.coefficient, cos(self.heading), sin(self.heading), north, east
        )

    def deceleration_rate(
        self,
        velocity: tuple[float, float],
        acceleration: tuple[float, float],
        heading_rate: float,
    ) -> tuple[float, float]:
        """The time derivative of `deceleration`, m/s³.

        Args:
            velocity: airspeed, north and east, m/s.
            acceleration: derivative of `velocity`, m/s².
            heading_rate: rate of change of `heading`, rad/s.
        """
        if self.coefficient == 0.0:
            return 0.0, 0.0
        cosine, sine = cos(self.heading), sin(self.heading)
        forward, right = _body_components(cosine, sine, *velocity)
        a_forward, a_right = _body_components(cosine, sine, *acceleration)
        # Derivatives of the components along the axes, which turn.
        forward_rate = a_forward + heading_rate * right
        right_rate = a_right - heading_rate * forward
        speed = _smooth_speed((forward, right, 0.0))
        mean_drag_speed = _MEAN_CUBE_SUM * speed
        mean_drag_speed_rate = (
            _MEAN_CUBE_SUM * (forward * forward_rate + right * right_rate) / speed
        )
        # d: deceleration along an axis, per coefficient.
        d_forward = forward * (abs(forward) - mean_drag_speed)
        d_right = right * (abs(right) - mean_drag_speed)
        d_forward_rate = (
            forward_rate * (2.0 * abs(forward) - mean_drag_speed) - mean_drag_speed_rate * forward
        )
        d_right_rate = (
            right_rate * (2.0 * abs(right) - mean_drag_speed) - mean_drag_speed_rate * right
        )
        forward = self.coefficient * (d_forward_rate - heading_rate * d_right)
        right = self.coefficient * (d_right_rate + heading_rate * d_forward)
        return cosine * forward - sine * right, sine * forward + cosine * right


def axis_drag_deceleration(
    coefficient: Number, cosine: Number, sine: Number, north: Number, east: Number
) -> tuple[Number, Number]:
    """Deceleration by an `AxisDrag`, north and east, m/s².

    `cosine` and `sine` are of `AxisDrag.heading`; `north` and `east` are the airspeed, m/s.
    """
    forward, right = _body_components(cosine, sine, north, east)
    mean_drag_speed = _MEAN_CUBE_SUM * _smooth_speed((forward, right, 0.0 * right))
    forward = coefficient * forward * (abs(forward) - mean_drag_speed)
    right = coefficient * right * (abs(right) - mean_drag_speed)
    return cosine * forward - sine * right, sine * forward + cosine * right


def _body_components(
    cosine: Number, sine: Number, north: Number, east: Number
) -> tuple[Number, Number]:
    return cosine * north + sine * east, cosine * east - sine * north


ROUND_BODY = AxisDrag()
"""A body whose drag is the same in all directions."""


def _smooth_speed(velocity: tuple[Number, Number, Number]) -> Number:
    north, east, down = velocity
    speed: Number = (north * north + east * east + down * down + _SPEED_SQUARED_MARGIN) ** 0.5
    return speed
