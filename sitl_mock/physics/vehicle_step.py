"""Steps of the vehicle with the ground, as arithmetic on floats and tuples.

`advance` is written so that numba can compile it unchanged: see `compiled.py`.
"""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from sitl_mock.physics.environment import GroundConstants, levelled_on_ground, survives_touchdown
from sitl_mock.physics.multirotor_step import (
    Actuation,
    Conditions,
    DelayRings,
    Kinematics,
    MultirotorConstants,
    at_rest,
    does_not_rise,
    drive,
    empty_rings,
    move,
)
from sitl_mock.physics.navigation_error import TruthHistory, TruthRow
from sitl_mock.physics.quaternion import Vector
from sitl_mock.physics.rigid_body import Load
from sitl_mock.physics.sensors import Estimate, SensorConstants, SensorState, estimate, white_noise


class ActuatorCommand(NamedTuple):
    """Setpoint of the rate loop and the rotors.

    Rates in rad/s, body FRD, without limit. In PX4's rate loop, NaN and infinity hold the present
    rate. In ArduPilot's, NaN holds the shaped rate; with infinity that rate grows without limit.
    Thrust 0..1; NaN or <= 0 stops the rotors, values above 1 mean 1.
    """

    armed: bool
    roll_rate: float
    pitch_rate: float
    yaw_rate: float
    thrust: float


DISARMED_COMMAND = ActuatorCommand(False, 0.0, 0.0, 0.0, 0.0)
"""Command while disarmed: the rotors stand still."""


class VehicleState(NamedTuple):
    """State of the vehicle after a step."""

    steps: int
    body: Kinematics
    actuation: Actuation
    position: Vector  # NED, m
    on_ground: bool
    crashed: bool
    touchdown_speed: float  # m/s down at the latest touchdown, NaN before the first


class VehicleConstants(NamedTuple):
    """Constants of the vehicle."""

    multirotor: MultirotorConstants
    ground: GroundConstants


def truth_row(body: Kinematics, position: Vector) -> TruthRow:
    """Return the row of the history after a step: see `TruthRow`."""
    motion, acceleration, _ = body
    return motion + position + acceleration


def advance(
    constants: VehicleConstants,
    rings: DelayRings,
    history: TruthHistory,
    state: VehicleState,
    command: ActuatorCommand,
    conditions: Conditions,
    count: int,
) -> VehicleState:
    """Advance by `count` steps under one command and the same conditions.

    `rings`, the latest setpoints, and `history`, a row of `truth_row` for each of the latest steps,
    are changed in place.
    """
    steps, body, actuation, position, on_ground, crashed, touchdown_speed = state
    armed, roll, pitch, yaw, thrust = command
    length = len(history)
    for _ in range(count):
        load, actuation = drive(
            constants.multirotor,
            rings,
            actuation,
            body,
            steps,
            (roll, pitch, yaw),
            thrust if armed and not crashed else 0.0,
            armed and not on_ground,
            conditions,
        )
        steps += 1
        body, position, on_ground, crashed, touchdown_speed = _move_or_rest(
            constants, body, position, on_ground, crashed, touchdown_speed, load
        )
        history[steps % length] = truth_row(body, position)
    return VehicleState(steps, body, actuation, position, on_ground, crashed, touchdown_speed)


def _move_or_rest(
    constants: VehicleConstants,
    body: Kinematics,
    position: Vector,
    on_ground: bool,
    crashed: bool,
    touchdown_speed: float,
    load: Load,
) -> tuple[Kinematics, Vector, bool, bool, float]:
    """Return the state after one step under this load.

    The state is: motion; position, m, NED; whether the vehicle is on the ground; whether it has
    crashed; sink speed of the latest touchdown, m/s.
    """
    multirotor, ground = constants
    _, _, _, w, x, y, z, _, _, _ = body[0]
    if crashed:
        return at_rest((w, x, y, z)), position, on_ground, crashed, touchdown_speed
    if on_ground and does_not_rise(multirotor, body, load):
        body = at_rest(levelled_on_ground(ground, (w, x, y, z)))
        return body, position, on_ground, crashed, touchdown_speed
    body, displacement = move(multirotor, body, load)
    north, east, down = position
    position = (north + displacement[0], east + displacement[1], down + displacement[2])
    _, _, sink_speed, w, x, y, z, _, _, _ = body[0]
    if position[2] >= 0.0 and sink_speed > 0.0:
        crashed = not survives_touchdown(ground, (w, x, y, z), sink_speed)
        body, position = at_rest((w, x, y, z)), (position[0], position[1], 0.0)
        return body, position, True, crashed, sink_speed
    return body, position, False, crashed, touchdown_speed


StepOutcome = tuple[bool, bool, float]
"""After the last step: on the ground, crashed, total thrust of the rotors (N)."""


def step_outcome(state: VehicleState) -> StepOutcome:
    """Return whether the vehicle is on the ground, whether it crashed, and its total thrust (N)."""
    _, (first, second, third, fourth), _, _ = state.actuation
    return state.on_ground, state.crashed, first + second + third + fourth


class Plant(Protocol):
    """A vehicle whose steps and estimates are computed in Python, or compiled.

    Args:
        state: state at the start.
        history_length: number of the latest steps whose motion is kept.
    """

    constants: VehicleConstants

    def __init__(
        self, constants: VehicleConstants, state: VehicleState, history_length: int
    ) -> None: ...

    @property
    def state(self) -> VehicleState:
        """State after the latest step."""

    def advance(self, command: ActuatorCommand, conditions: Conditions, count: int) -> StepOutcome:
        """Advance by `count` steps under one command."""

    def truth_ago(self, steps: int) -> TruthRow:
        """The true motion `steps` steps ago."""

    def estimate(
        self, constants: SensorConstants, state: SensorState, time: float, noise: Sequence[float]
    ) -> tuple[Estimate, Vector]:
        """The present estimate of the autopilot: see `sensors.estimate`."""

    @staticmethod
    def make_noise(uniform_numbers: list[float], deviations: tuple[float, ...]) -> Sequence[float]:
        """Turn uniform random numbers into normal ones: see `sensors.white_noise`."""


class PythonPlant:
    """A vehicle whose steps and estimates are computed in Python; for the arguments see `Plant`."""

    def __init__(
        self, constants: VehicleConstants, state: VehicleState, history_length: int
    ) -> None:
        self.state = state
        self.constants = constants
        self._delay_rings = empty_rings(constants.multirotor)
        self._history = [truth_row(state.body, state.position)] * history_length

    def advance(self, command: ActuatorCommand, conditions: Conditions, count: int) -> StepOutcome:
        """Advance by `count` steps under one command."""
        self.state = advance(
            self.constants, self._delay_rings, self._history, self.state, command, conditions, count
        )
        return step_outcome(self.state)

    def truth_ago(self, steps: int) -> TruthRow:
        """The true motion `steps` steps ago."""
        return self._history[(self.state.steps - steps) % len(self._history)]

    def estimate(
        self, constants: SensorConstants, state: SensorState, time: float, noise: Sequence[float]
    ) -> tuple[Estimate, Vector]:
        """The present estimate of the autopilot: see `sensors.estimate`."""
        return estimate(constants, state, self._history, self.state.steps, time, noise)

    @staticmethod
    def make_noise(uniform_numbers: list[float], deviations: tuple[float, ...]) -> Sequence[float]:
        """Turn uniform random numbers into normal ones: see `sensors.white_noise`."""
        white_noise(uniform_numbers, deviations)
        return uniform_numbers
