"""Linear and quadratic drag per mass, the same along all axes."""

from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

Number = TypeVar("Number", float, NDArray[np.float64])
"""Type of a vector component: a number, an array, or a CasADi symbol."""

_TINY = 1e-12
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
        """Deceleration in m/s², along a velocity in m/s."""
        north, east, down = velocity
        share = self.linear + self.quadratic * _speed(velocity)
        return share * north, share * east, share * down

    def growth(
        self, velocity: tuple[Number, Number, Number], acceleration: tuple[Number, Number, Number]
    ) -> tuple[Number, Number, Number]:
        """The time derivative of `deceleration`, m/s³, at a velocity and an acceleration."""
        speed = _speed(velocity)
        share = self.linear + self.quadratic * speed
        north, east, down = velocity
        a_north, a_east, a_down = acceleration
        along = self.quadratic * (north * a_north + east * a_east + down * a_down) / speed
        return (
            share * a_north + along * north,
            share * a_east + along * east,
            share * a_down + along * down,
        )


NO_DRAG = Drag()


def _speed(velocity: tuple[Number, Number, Number]) -> Number:
    north, east, down = velocity
    speed: Number = (north * north + east * east + down * down + _TINY) ** 0.5
    return speed
