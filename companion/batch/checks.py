"""Checks and limits arrays of attitudes and targets, as a planner does with a single one."""

from functools import cache
from math import pi
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from companion.attitude.representation import (
    LARGEST_HEADING_RATE,
    NORM_TOLERANCE,
    limited_target,
    normalised,
)
from companion.attitude.types import InvalidQuaternionError, InvalidTargetError, Target
from companion.batch.compiler import Compiler
from companion.batch.loops import Array

_UNIT_TOLERANCE = 1e-14
"""Largest deviation of a squared norm from 1 at which a quaternion is not normalised again."""


def as_float_array(values: ArrayLike, name: str) -> Array:
    """Convert `values` to a C-contiguous float array (4, n); messages call it `name`.

    Raises:
        ValueError: `values` have another shape.
    """
    array = np.ascontiguousarray(values, dtype=np.float64)
    if array.ndim != 2 or array.shape[0] != 4:
        raise ValueError(f"{name} must have the shape (4, n), not {array.shape}")
    return array


@cache
def compiled_check() -> Any:
    """`all_usable`, compiled. In numpy the checks would take as long as a compiled law."""
    return Compiler({}).compile_loop(all_usable)


def all_usable(q: Array, targets: Array, max_norm: float) -> bool:
    """Whether no quaternion needs normalising and no target needs limiting, for n vehicles.

    `q` and `targets` are (4, n); `max_norm` is the largest norm of a target's coefficients.
    Conditions are joined by `&` and counted, because only a loop without branches is vectorised.
    """
    refused_count = 0
    for i in range(q.shape[1]):
        norm_square = q[0, i] * q[0, i] + q[1, i] * q[1, i] + q[2, i] * q[2, i] + q[3, i] * q[3, i]
        length_square = targets[0, i] * targets[0, i] + targets[1, i] * targets[1, i]
        is_usable = (
            (abs(norm_square - 1.0) <= _UNIT_TOLERANCE)
            & (length_square <= max_norm * max_norm)
            & (abs(targets[2, i]) < pi)
            & (abs(targets[3, i]) <= LARGEST_HEADING_RATE)
        )
        refused_count += 0 if is_usable else 1
    return refused_count == 0


def unit_quaternions(q: Array) -> Array:
    """`q` (4, n) with unit norm.

    Raises:
        InvalidQuaternionError: a norm is off by more than 1e-3, or a component is not finite.
    """
    norm: Array = np.sqrt(np.einsum("ij,ij->j", q, q))
    for i in np.flatnonzero(~(np.abs(norm - 1.0) <= NORM_TOLERANCE)):
        w, x, y, z = q[:, i].tolist()
        try:
            normalised((w, x, y, z))
        except InvalidQuaternionError as error:
            raise InvalidQuaternionError(f"vehicle {i}: {error}") from None
    return q / norm


def limited_targets(targets: Array, max_norm: float) -> Array:
    """`targets` (4, n), each as `limited_target` returns it.

    Targets within the limits are copied all at once, the others are limited one by one.

    Raises:
        InvalidTargetError: a value is not finite or far too large.
    """
    north, east, heading, heading_rate = targets
    with np.errstate(over="ignore", invalid="ignore"):  # such a target is refused below
        is_within_limits = north * north + east * east <= max_norm * max_norm
    is_within_limits &= (
        (heading > -pi) & (heading <= pi) & (np.abs(heading_rate) <= LARGEST_HEADING_RATE)
    )
    limited = targets.copy()
    for i in np.flatnonzero(~is_within_limits):
        try:
            limited[:, i] = limited_target(Target(*targets[:, i].tolist()), max_norm)
        except InvalidTargetError as error:
            raise InvalidTargetError(f"vehicle {i}: {error}") from None
    return limited
