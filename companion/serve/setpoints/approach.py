"""The commanded state along one or more axes, and jerk-limited motions that approach it.

Ruckig computes the motions (extra `serve`).
"""

from collections.abc import Sequence
from math import hypot
from typing import NamedTuple

from ruckig import ControlInterface, InputParameter, Ruckig, RuckigError, Trajectory

AxisValues = tuple[float, ...]
"""One number for each axis."""


class AxisState(NamedTuple):
    """Position, velocity and acceleration along one or more axes; SI units or radians."""

    position: AxisValues
    velocity: AxisValues
    acceleration: AxisValues


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


class AxisLimits(NamedTuple):
    """Limits of a motion along one axis, in SI units or radians."""

    velocity: float
    """Largest speed in the positive direction."""
    backward_velocity: float
    """Largest speed in the negative direction, as a positive number."""
    acceleration: float
    """Largest acceleration in both directions."""
    jerk: float
    """Largest jerk in both directions."""


class UnplannableError(ValueError):
    """Ruckig finds no motion that reduces the position or velocity error to zero.

    The numbers in this error or in the limits are too large, differ by too many orders of
    magnitude, or are not finite.
    """


class Approach:
    """A time-optimal motion that reduces an error to zero.

    Args:
        error: error at the beginning of the motion.
        limits: limits of the motion, one for each axis.
        begin_time: event-loop time at the beginning, s.
        by_velocity: whether only the velocity error must become zero, not the position error.

    Raises:
        UnplannableError: Ruckig finds no motion within the limits.
    """

    def __init__(
        self,
        error: AxisState,
        limits: Sequence[AxisLimits],
        begin_time: float,
        *,
        by_velocity: bool,
    ) -> None:
        axis_count = len(limits)
        ruckig_input = InputParameter(axis_count)
        ruckig_input.current_position = list(error.position)
        ruckig_input.current_velocity = list(error.velocity)
        ruckig_input.current_acceleration = list(error.acceleration)
        ruckig_input.target_position = [0.0] * axis_count
        ruckig_input.max_velocity = [each.velocity for each in limits]
        ruckig_input.min_velocity = [-each.backward_velocity for each in limits]
        ruckig_input.max_acceleration = [each.acceleration for each in limits]
        ruckig_input.max_jerk = [each.jerk for each in limits]
        if by_velocity:
            ruckig_input.control_interface = ControlInterface.Velocity
        self._begin_time = begin_time
        self._trajectory = Trajectory(axis_count)
        try:
            result = Ruckig(axis_count).calculate(ruckig_input, self._trajectory)
        # Ruckig raises ValueError for a result code that its Python enumeration lacks.
        except (RuckigError, RuntimeError, ValueError) as error_of_solver:
            raise _unplannable_error(error_of_solver) from error_of_solver
        if int(result) < 0:
            raise _unplannable_error(result)

    def at(self, time: float) -> AxisState:
        """The error at a time, s; after the end of the motion it stays constant."""
        elapsed = max(0.0, time - self._begin_time)
        position, velocity, acceleration = self._trajectory.at_time(elapsed)[:3]
        return AxisState(tuple(position), tuple(velocity), tuple(acceleration))


def plus(left: AxisValues, right: AxisValues) -> AxisValues:
    """The sum of two vectors."""
    return tuple([a + b for a, b in zip(left, right, strict=True)])


def _minus(left: AxisValues, right: AxisValues) -> AxisValues:
    return tuple(a - b for a, b in zip(left, right, strict=True))


def are_far_apart(left: AxisValues, right: AxisValues, distance: float) -> bool:
    """Whether two vectors are further apart than `distance`."""
    return hypot(*_minus(left, right)) > distance


def _unplannable_error(reason: object) -> UnplannableError:
    return UnplannableError(
        f"no motion within the limits leads to this setpoint ({' '.join(str(reason).split())})"
    )
