"""The loops over vehicles and samples that call a law, in Python or compiled.

Compiled inner loops are vectorised. To allow that, they run over whole C-contiguous arrays, from 0
to the end, and do not write to arrays that they read. The law (`apply_law`) and the rotation
(`rotate_all`) have a loop each, because one loop for both needs more registers than a processor
has.
"""

import math
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from companion.attitude import rotation
from companion.attitude.limits import Constants
from companion.attitude.planner import Law
from companion.batch import series
from companion.batch.compiler import Compiler, Substitutes

Array = NDArray[np.float64]

_ARCTANGENT: Substitutes = {math.atan: series.arctangent}
_ALL_SERIES: Substitutes = {**_ARCTANGENT, rotation.cos_and_sinc: series.cos_and_sinc}

_ApplyLaw = Callable[[Array, Array, Array, float, Constants], None]
_RotateAll = Callable[[Array, Array, Array, float], None]


class Loops(NamedTuple):
    """Functions that apply one law to n vehicles, compiled or in Python."""

    apply_law: _ApplyLaw
    """(q, targets, rates, dt, constants): fills rates (3, n)."""
    advance: Callable[[Array, Array, Array, Array, float, Constants, int], None]
    """(even_q, odd_q, targets, rates, dt, constants, steps): advances the attitudes. even_q (4, n)
    holds those at the start and after even steps, odd_q (4, n) those after odd steps."""
    record: Callable[[Array, Array, Array, float, Constants], None]
    """(q, targets, rates, dt, constants): fills q (steps + 1, 4, n) from q[0] on, and rates
    (steps, 3, n)."""
    any_angle: bool
    """Whether the loops are valid for turns of more than 1 rad per sample."""


@cache
def _compiler(any_angle: bool) -> Compiler:
    """Make one compiler for all laws, because they call mostly the same functions."""
    return Compiler(_ARCTANGENT if any_angle else _ALL_SERIES)


@cache
def compiled_loops(law: Law, any_angle: bool = False) -> Loops:
    """Compile the loops of `law`; faster without `any_angle`, but only for turns up to 1 rad."""
    compiler = _compiler(any_angle)
    vehicle_law = compiler.compile_function(law)

    def apply_law(q: Array, targets: Array, rates: Array, dt: float, constants: Constants) -> None:
        for i in range(q.shape[1]):
            attitude = q[0, i], q[1, i], q[2, i], q[3, i]
            target = targets[0, i], targets[1, i], targets[2, i], targets[3, i]
            rates[0, i], rates[1, i], rates[2, i] = vehicle_law(attitude, target, dt, constants)

    return _sample_loops(
        compiler.compile_loop(apply_law),
        _compiled_rotation(any_angle),
        compiler.compile_loop,
        any_angle,
    )


@cache
def _compiled_rotation(any_angle: bool) -> _RotateAll:
    compiler = _compiler(any_angle)
    rotate = compiler.compile_function(rotation.after_constant_rates)

    def rotate_all(q: Array, rates: Array, next_q: Array, dt: float) -> None:
        for i in range(q.shape[1]):
            attitude = q[0, i], q[1, i], q[2, i], q[3, i]
            body_rates = rates[0, i], rates[1, i], rates[2, i]
            next_q[0, i], next_q[1, i], next_q[2, i], next_q[3, i] = rotate(
                attitude, body_rates, dt
            )

    compiled: _RotateAll = compiler.compile_loop(rotate_all)
    return compiled


@cache
def plain_loops(law: Law) -> Loops:
    """Loops that call `law` for one vehicle after the other with Python floats, uncompiled."""
    vehicle_law: Any = law
    rotate: Any = rotation.after_constant_rates

    def apply_law(q: Array, targets: Array, rates: Array, dt: float, constants: Constants) -> None:
        vehicles = zip(q.T.tolist(), targets.T.tolist(), strict=True)
        rates[...] = np.transpose([vehicle_law(*vehicle, dt, constants) for vehicle in vehicles])

    def rotate_all(q: Array, rates: Array, next_q: Array, dt: float) -> None:
        vehicles = zip(q.T.tolist(), rates.T.tolist(), strict=True)
        next_q[...] = np.transpose([rotate(*vehicle, dt) for vehicle in vehicles])

    return _sample_loops(apply_law, rotate_all, lambda loop: loop, any_angle=True)


def _sample_loops(
    apply_law: _ApplyLaw, rotate_all: _RotateAll, compiled: Callable[[Any], Any], any_angle: bool
) -> Loops:
    """Make the loops over samples from the loops over vehicles.

    `compiled` compiles a loop, or returns it unchanged.
    """

    def advance(
        even_q: Array,
        odd_q: Array,
        targets: Array,
        rates: Array,
        dt: float,
        constants: Constants,
        steps: int,
    ) -> None:
        for _ in range(steps // 2):
            apply_law(even_q, targets, rates, dt, constants)
            rotate_all(even_q, rates, odd_q, dt)
            apply_law(odd_q, targets, rates, dt, constants)
            rotate_all(odd_q, rates, even_q, dt)
        if steps % 2:
            apply_law(even_q, targets, rates, dt, constants)
            rotate_all(even_q, rates, odd_q, dt)

    def record(q: Array, targets: Array, rates: Array, dt: float, constants: Constants) -> None:
        for k in range(rates.shape[0]):
            apply_law(q[k], targets, rates[k], dt, constants)
            rotate_all(q[k], rates[k], q[k + 1], dt)

    return Loops(apply_law, compiled(advance), compiled(record), any_angle)
