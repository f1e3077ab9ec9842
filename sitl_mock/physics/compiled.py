"""The vehicle's steps compiled by numba, from the same source; results are equal to the last bit.

Compiling pays off for whole flights in one process. Importing this module takes half a second.
Compiling takes ten seconds, once for each version of the source on a computer. A compiled step
costs a tenth of a step in Python.
"""

import os
from collections.abc import Callable, Sequence
from hashlib import sha256
from pathlib import Path
from types import FunctionType
from typing import Any, TypeVar, cast

import numba
import numpy as np
from numba.extending import intrinsic, register_jitable

from sitl_mock.physics.multirotor_step import Conditions, DelayRings, empty_rings
from sitl_mock.physics.navigation_error import TruthRow
from sitl_mock.physics.quaternion import Vector
from sitl_mock.physics.sensors import Estimate, SensorConstants, SensorState, estimate, white_noise
from sitl_mock.physics.vehicle import Vehicle
from sitl_mock.physics.vehicle_step import (
    ActuatorCommand,
    StepOutcome,
    VehicleConstants,
    VehicleState,
    advance,
    step_outcome,
    truth_row,
)

T = TypeVar("T")


def _all_callees(function: Any) -> set[FunctionType]:
    """Return all functions that a function calls, directly or through others."""
    globals_used = [function.__globals__.get(name) for name in function.__code__.co_names]
    callees = {each for each in globals_used if isinstance(each, FunctionType)}
    return callees.union(*(_all_callees(each) for each in callees))


_COMPILED_FUNCTIONS: set[Any] = {advance, step_outcome, estimate, white_noise}
_COMPILED_FUNCTIONS |= _all_callees(advance) | _all_callees(estimate)
for _function in _COMPILED_FUNCTIONS:
    register_jitable(_function)


def _compiled(function: Callable[..., T]) -> Callable[..., T]:
    """Compile a function when it is first called, and keep the code for other processes.

    numba notices a change only in the file of `function`. So each version of the source has its own
    folder for compiled code.
    """
    files = {each.__code__.co_filename for each in _COMPILED_FUNCTIONS} | {__file__}
    source_hash = sha256(b"".join(Path(file).read_bytes() for file in sorted(files))).hexdigest()[
        :16
    ]
    cache_home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    configured_folder = numba.config.CACHE_DIR  # NUMBA_CACHE_DIR
    folder = (
        Path(configured_folder) if configured_folder else cache_home / "sitl_mock"
    ) / source_hash
    try:
        folder.mkdir(parents=True, exist_ok=True)
        numba.config.CACHE_DIR = str(folder)
        compiled: Callable[..., T] = numba.njit(function, cache=os.access(folder, os.W_OK))
    except OSError:  # each process compiles for itself
        compiled = numba.njit(function)
    finally:
        numba.config.CACHE_DIR = configured_folder
    return compiled


def _load_and_store(numba_type: Any) -> tuple[Any, Any]:
    """Return compiled functions that load and store a value of a numba type in an array of bytes.

    Constants and state stay in such an array, because passing one of them between Python and
    compiled code costs as much as 20 steps.
    """

    def pointer(context: Any, builder: Any, array_type: Any, array: Any) -> Any:
        data = context.make_array(array_type)(context, builder, array).data
        return builder.bitcast(data, context.get_value_type(numba_type).as_pointer())

    def load(_context: Any, memory: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.load(pointer(context, builder, signature.args[0], arguments[0]))

        return numba_type(memory), generate

    def store(_context: Any, memory: Any, value: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            builder.store(arguments[1], pointer(context, builder, signature.args[0], arguments[0]))
            return context.get_dummy_value()

        return numba.types.none(memory, numba_type), generate

    return intrinsic(load), intrinsic(store)


_EXAMPLE_VEHICLE = Vehicle(seed=0)  # its attributes have the types to compile for
_EXAMPLE_SENSORS = _EXAMPLE_VEHICLE.estimator.constants, _EXAMPLE_VEHICLE.estimator.state
_load_constants, _store_constants = _load_and_store(numba.typeof(_EXAMPLE_VEHICLE.plant.constants))
_load_state, _store_state = _load_and_store(numba.typeof(_EXAMPLE_VEHICLE.plant.state))
_load_sensors, _store_sensors = _load_and_store(numba.typeof(_EXAMPLE_SENSORS))


@_compiled
def _store_plant(
    constants_memory: Any, constants: VehicleConstants, state_memory: Any, state: VehicleState
) -> None:
    _store_constants(constants_memory, constants)
    _store_state(state_memory, state)


@_compiled
def _read_state(state_memory: Any) -> Any:
    return _load_state(state_memory)


@_compiled
def _advance(
    constants_memory: Any,
    state_memory: Any,
    before_shaping: Any,
    before_rate_loop: Any,
    history: Any,
    armed: bool,
    roll: float,
    pitch: float,
    yaw: float,
    thrust: float,
    thrust_factor: float,
    wind: tuple[float, float, float],
    attitude_error: tuple[float, float, float],
    count: int,
) -> StepOutcome:
    state = advance(
        _load_constants(constants_memory),
        DelayRings(before_shaping, before_rate_loop),
        history,
        _load_state(state_memory),
        ActuatorCommand(armed, roll, pitch, yaw, thrust),
        Conditions(thrust_factor, wind, attitude_error),
        count,
    )
    _store_state(state_memory, state)
    return step_outcome(state)


@_compiled
def _write_sensors(memory: Any, sensors: tuple[SensorConstants, SensorState]) -> None:
    _store_sensors(memory, sensors)


@_compiled
def _estimate(memory: Any, history: Any, steps: int, time: float, noise: Any) -> Any:
    constants, state = _load_sensors(memory)
    return estimate(constants, state, history, steps, time, noise)


_white_noise = _compiled(white_noise)


class CompiledPlant:
    """A vehicle whose steps and estimates are compiled; `Plant` explains the arguments."""

    def __init__(
        self, constants: VehicleConstants, state: VehicleState, history_length: int
    ) -> None:
        self.constants, self._constants_memory = constants, _memory_for(constants)
        self._state_memory = _memory_for(state)
        _store_plant(self._constants_memory, constants, self._state_memory, state)
        self._before_shaping, self._before_rate_loop = (
            np.array(ring) for ring in empty_rings(constants.multirotor)
        )
        self._history = np.array([truth_row(state.body, state.position)] * history_length)
        self._state: VehicleState | None = state
        self._steps = state.steps
        self._sensor_memory = _memory_for(_EXAMPLE_SENSORS)
        self._sensor_state: SensorState | None = None

    @property
    def state(self) -> VehicleState:
        """State after the latest step."""
        if self._state is None:
            self._state = _read_state(self._state_memory)
        return self._state

    def advance(self, command: ActuatorCommand, conditions: Conditions, count: int) -> StepOutcome:
        """Advance by `count` steps under one command."""
        self._steps += count
        self._state = None
        return _advance(
            self._constants_memory,
            self._state_memory,
            self._before_shaping,
            self._before_rate_loop,
            self._history,
            *command,
            *conditions,
            count,
        )

    def truth_ago(self, steps: int) -> TruthRow:
        """The true motion `steps` steps ago."""
        row: TruthRow = tuple(self._history[(self._steps - steps) % len(self._history)].tolist())
        return row

    def estimate(
        self, constants: SensorConstants, state: SensorState, time: float, noise: Any
    ) -> tuple[Estimate, Vector]:
        """The present estimate of the autopilot: see `sensors.estimate`."""
        if state is not self._sensor_state:
            self._sensor_state = state
            _write_sensors(self._sensor_memory, (constants, state))
        estimated: tuple[Estimate, Vector] = _estimate(
            self._sensor_memory, self._history, self._steps, time, noise
        )
        return estimated

    @staticmethod
    def make_noise(uniform_numbers: list[float], deviations: tuple[float, ...]) -> Sequence[float]:
        """Turn uniform random numbers into normal ones: see `sensors.white_noise`."""
        numbers: Any = np.array(uniform_numbers)
        _white_noise(numbers, deviations)
        return cast("Sequence[float]", numbers)


def _memory_for(numbers: tuple[Any, ...]) -> Any:
    """Return an array of bytes with room for the numbers of a tuple, which may contain tuples."""

    def count(value: Any) -> int:
        if isinstance(value, tuple):
            return sum(map(count, value))
        return 2 if isinstance(value, complex) else 1

    return np.zeros(8 * count(numbers), np.uint8)
