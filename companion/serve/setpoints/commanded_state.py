"""The commanded state along one or more axes, extrapolated between two setpoints."""

from math import hypot
from typing import NamedTuple

from companion.serve.setpoints.approach import AxisState, AxisValues


class AxisMotion(NamedTuple):
    """Position (m) and velocity (m/s) of the vehicle along one or more axes."""

    position: AxisValues
    velocity: AxisValues


class CommandedState(NamedTuple):
    """The commanded state at the time `begin_time`, s; from then on the jerk is constant.

    Position, velocity, acceleration and jerk are in SI units or radians.
    """

    position: AxisValues
    velocity: AxisValues
    acceleration: AxisValues
    jerk: AxisValues
    begin_time: float

    def at(self, time: float) -> AxisState:
        """The commanded state extrapolated to a time, s."""
        t = max(0.0, time - self.begin_time)
        position, velocity, acceleration = [], [], []
        rows = zip(self.position, self.velocity, self.acceleration, self.jerk, strict=True)
        for p, v, a, j in rows:  # one fast loop: each step of guidance asks for a dozen states
            position.append(p + t * (v + t * (0.5 * a + t * j / 6.0)))
            velocity.append(v + t * (a + 0.5 * t * j))
            acceleration.append(a + t * j)
        return AxisState(tuple(position), tuple(velocity), tuple(acceleration))

    def error_of(self, state: AxisState) -> AxisState:
        """A state minus the commanded state at `begin_time`."""
        return AxisState(
            _minus(state.position, self.position),
            _minus(state.velocity, self.velocity),
            _minus(state.acceleration, self.acceleration),
        )


def plus(left: AxisValues, right: AxisValues) -> AxisValues:
    """The sum of two vectors."""
    return tuple([a + b for a, b in zip(left, right, strict=True)])


def _minus(left: AxisValues, right: AxisValues) -> AxisValues:
    return tuple(a - b for a, b in zip(left, right, strict=True))


def are_far_apart(left: AxisValues, right: AxisValues, distance: float) -> bool:
    """Whether two vectors are further apart than `distance`."""
    return hypot(*_minus(left, right)) > distance
