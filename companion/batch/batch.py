"""Body rates, attitudes and histories of many vehicles under one planner."""

# So that `help` names `ArrayLike`, instead of the twelve lines that it stands for.
from __future__ import annotations

import importlib.util
from math import ceil
from operator import index
from types import FunctionType
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from companion.attitude.kinematics import half_tilt_products
from companion.attitude.planner import LAW_NAMES, Law, LawPlanner, Planner
from companion.attitude.representation import require_period
from companion.batch.checks import (
    as_float_array,
    compiled_check,
    limited_targets,
    unit_quaternions,
)
from companion.batch.loops import Array, Loops, compiled_loops, plain_loops
from companion.extras import require

MIN_STEPS_TO_COMPILE = 600_000
"""Steps of all vehicles together above which compiling is faster.

Compiling costs 2 to 3 s once in a process, including the import of numba. A step in Python costs
about 4 µs.
"""

_BLOCK_SIZE = 336
"""Number of vehicles that are advanced together; their data then fits the first-level cache."""

_CACHE_LINE = 8  # float64 numbers


class History(NamedTuple):
    """The result of `simulate`: attitudes q (steps + 1, 4, n), body rates (steps, 3, n) in rad/s.

    The vehicles turn at `rates[k]` from `q[k]` to `q[k + 1]`.
    """

    q: Array
    rates: Array


def can_compile() -> bool:
    """Whether numba and its compiler are installed."""
    return all(importlib.util.find_spec(module) for module in ("numba", "llvmlite"))


def rates(
    planner: Planner,
    q: ArrayLike,
    targets: ArrayLike,
    dt: float,
    compiled: bool | None = None,
) -> Array:
    """Body rates of many vehicles: for each vehicle the result of `planner.rates`.

    Args:
        planner: a planner without memory; gives the law and its constants.
        q: (4, n) attitudes w, x, y, z, body → world.
        targets: (4, n) coefficients north and east, heading in rad, heading rate in rad/s.
        dt: the sample period, s; positive and finite.
        compiled: True: numba. False: Python. None: numba if it is installed, this call has at least
            `MIN_STEPS_TO_COMPILE` steps, and the law is a function at the top of a module. In a
            loop of your own pass True.

    Returns:
        (3, n) roll, pitch, yaw in rad/s, body FRD. The results of numba and Python differ by about
        1e-15 rad/s; with the law `exact`, the angles of one sample (rate · dt) by 1e-15 rad.

    Raises:
        InvalidPeriodError: `dt` is not positive and finite.
        InvalidQuaternionError: an attitude is not a unit quaternion.
        InvalidTargetError: a value of a target is not finite or far too large.
        MissingExtraError: `compiled` is True and numba is not installed.
        TypeError: the planner keeps state between samples, or `compiled` is True and its law is not
            a plain function.
        ValueError: the shapes of `q` and `targets` are wrong or differ.
    """
    planner, q, targets, loops = _checked_arguments(planner, q, targets, dt, 1, compiled)
    body_rates = np.empty((3, q.shape[1]))
    loops.apply_law(q, targets, body_rates, dt, planner.constants)
    return body_rates


def advance(
    planner: Planner,
    q: ArrayLike,
    targets: ArrayLike,
    dt: float,
    steps: int,
    compiled: bool | None = None,
) -> Array:
    """Attitudes (4, n) after `steps` samples, each with constant body rates.

    Arguments and errors are those of `rates`. Also, a negative `steps` raises ValueError, and a
    `steps` that is not an integer raises TypeError.
    """
    planner, q, targets, loops = _checked_arguments(planner, q, targets, dt, steps, compiled)
    final_q = _final_attitudes(loops, planner, q, targets, dt, steps)
    if _turned_too_far(loops, final_q):
        loops = compiled_loops(planner.law, any_angle=True)
        final_q = _final_attitudes(loops, planner, q, targets, dt, steps)
    return final_q


def simulate(
    planner: Planner,
    q: ArrayLike,
    targets: ArrayLike,
    dt: float,
    steps: int,
    compiled: bool | None = None,
) -> History:
    """As `advance`, but returns the attitudes and body rates of all samples."""
    planner, q, targets, loops = _checked_arguments(planner, q, targets, dt, steps, compiled)
    history = History(np.empty((steps + 1, *q.shape)), np.empty((steps, 3, q.shape[1])))
    history.q[0] = q
    loops.record(history.q, targets, history.rates, dt, planner.constants)
    if _turned_too_far(loops, history.q[-1]):
        loops = compiled_loops(planner.law, any_angle=True)
        loops.record(history.q, targets, history.rates, dt, planner.constants)
    return history


def coefficients(q: ArrayLike) -> Array:
    """Acceleration coefficients of many attitudes (equation 10).

    `companion.attitude.coefficients` computes those of one attitude.

    Args:
        q: (..., 4, n) unit quaternions w, x, y, z, such as `History.q`; they are not checked.

    Returns:
        (..., 2, n) north, east.

    Raises:
        ValueError: the last dimension but one does not have four components.
    """
    quaternions = np.asarray(q, dtype=np.float64)
    if quaternions.ndim < 2 or quaternions.shape[-2] != 4:
        raise ValueError(f"q must have the shape (..., 4, n), not {quaternions.shape}")
    _, ax, ay = half_tilt_products(*np.moveaxis(quaternions, -2, 0))
    return np.stack([-2.0 * np.asarray(ay), 2.0 * np.asarray(ax)], axis=-2)


def _checked_arguments(
    planner: Planner,
    q: ArrayLike,
    targets: ArrayLike,
    dt: float,
    steps: int,
    compiled: bool | None,
) -> tuple[LawPlanner, Array, Array, Loops]:
    """Check the arguments; return planner, normalised attitudes, limited targets and loops."""
    if not isinstance(planner, LawPlanner):
        raise TypeError(
            f"a batch cannot use {type(planner).__name__}, only a planner without memory, made by "
            f"make_planner ({', '.join(LAW_NAMES)}, or a law of your own); make one planner for "
            "each vehicle, and call its rates() for each sample"
        )
    q, targets = as_float_array(q, "q"), as_float_array(targets, "targets")
    if q.shape != targets.shape:
        raise ValueError(f"{q.shape[1]} attitudes, but {targets.shape[1]} targets")
    require_period(dt)
    if index(steps) < 0:
        raise ValueError(f"steps must not be negative, not {steps}")
    if compiled is None:
        worth_compiling = q.shape[1] * steps >= MIN_STEPS_TO_COMPILE
        compiled = worth_compiling and can_compile() and _is_plain_function(planner.law)
    max_target_norm = planner.constants.max_target_norm
    if compiled:
        require("numba", "study", "a compiled batch")
        _require_plain_function(planner.law)
        loops = compiled_loops(planner.law)
        if compiled_check()(q, targets, max_target_norm):
            return planner, q, targets, loops
    else:
        loops = plain_loops(planner.law)
    return planner, unit_quaternions(q), limited_targets(targets, max_target_norm), loops


def _is_plain_function(law: Law) -> bool:
    """Whether a law can be compiled: a function without closure and default arguments."""
    return isinstance(law, FunctionType) and not (law.__closure__ or law.__defaults__)


def _require_plain_function(law: Law) -> None:
    """Refuse a law that cannot be compiled.

    Raises:
        TypeError: the law is no function, has default arguments, or uses variables of an enclosing
            function.
    """
    if not _is_plain_function(law):
        raise TypeError(
            f"the law {getattr(law, '__name__', law)!r} cannot be compiled: write it as a function "
            "at the top of a module, without default arguments and without variables of an "
            "enclosing function, or pass compiled=False"
        )


def _turned_too_far(loops: Loops, q: Array) -> bool:
    """Whether q is NaN: a turn in one sample was too large for the polynomials of `loops`."""
    return not loops.any_angle and not bool(np.isfinite(q).all())


def _final_attitudes(
    loops: Loops, planner: LawPlanner, q: Array, targets: Array, dt: float, steps: int
) -> Array:
    """The attitudes (4, n) after all steps, computed block by block."""
    final_q = np.empty_like(q)
    block_count = max(1, ceil(q.shape[1] / _BLOCK_SIZE))
    block_size = _CACHE_LINE * max(1, ceil(q.shape[1] / block_count / _CACHE_LINE))
    for first_vehicle in range(0, q.shape[1], block_size):
        block = slice(first_vehicle, min(first_vehicle + block_size, q.shape[1]))
        even_q, odd_q, block_targets, block_rates = _aligned_arrays(block.stop - block.start)
        even_q[...] = q[:, block]
        block_targets[...] = targets[:, block]
        loops.advance(even_q, odd_q, block_targets, block_rates, dt, planner.constants, steps)
        final_q[:, block] = odd_q if steps % 2 else even_q
    return final_q


def _aligned_arrays(count: int) -> tuple[Array, Array, Array, Array]:
    """Three arrays (4, count) and one (3, count) in one block that starts on a cache line.

    Separate or unaligned arrays make a step up to a quarter slower.
    """
    row_count = 15
    memory = np.empty(row_count * count + _CACHE_LINE)
    first_aligned = -(memory.ctypes.data // memory.itemsize) % _CACHE_LINE
    aligned = memory[first_aligned : first_aligned + row_count * count].reshape(row_count, count)
    return aligned[0:4], aligned[4:8], aligned[8:12], aligned[12:15]
