"""The commanded state along some axes, extrapolated between two setpoints."""

from math import hypot
from typing import NamedTuple

from companion.serve.setpoints.approach import State, Values


class AxisMotion(NamedTuple):
    """Motion of the vehicle along some axes; SI units.

    Attributes:
        position: m.
        velocity: m/s.
    """

    position: Values
    velocity: Values


class CommandedState(NamedTuple):
    """The commanded state at the time `begins`, s; from then on the jerk is constant.

    Position, velocity, acceleration and jerk are in SI units or radians.
    """

    position: Values
    velocity: Values
    acceleration: Values
    jerk: Values
    begins: float

    def at(self, time: float) -> State:
        """The state at a time, s."""
        t = max(0.0, time - self.begins)
        position, velocity, acceleration = [], [], []
        rows = zip(self.position, self.velocity, self.acceleration, self.jerk, strict=True)
        for p, v, a, j in rows:  # one fast loop: each step of guidance asks for a dozen states
            position.append(p + t * (v + t * (0.5 * a + t * j / 6.0)))
            velocity.append(v + t * (a + 0.5 * t * j))
            acceleration.append(a + t * j)
        return State(tuple(position), tuple(velocity), tuple(acceleration))

    def error_of(self, state: State) -> State:
        """A state minus the commanded state at `begins`."""
        return State(
            _minus(state.position, self.position),
            _minus(state.velocity, self.velocity),
            _minus(state.acceleration, self.acceleration),
        )


def plus(left: Values, right: Values) -> Values:
    """The sum of two vectors."""
    return tuple([a + b for a, b in zip(left, right, strict=True)])


def _minus(left: Values, right: Values) -> Values:
    return tuple(a - b for a, b in zip(left, right, strict=True))


def are_far_apart(left: Values, right: Values, distance: float) -> bool:
    """Whether two vectors are further apart than `distance`."""
    return hypot(*_minus(left, right)) > distance
