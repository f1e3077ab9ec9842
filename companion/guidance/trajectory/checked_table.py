"""Checks a table of samples that a user's program made; a file is checked when it is read."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from companion.guidance.trajectory.csv_file import FEWEST_SAMPLES, Table
from companion.guidance.trajectory.sample import TrajectoryError
from companion.guidance.trajectory.septic_spline import Floats


def checked_table(table: Table) -> Table:
    """The table, checked and converted to arrays of floats.

    Raises:
        TrajectoryError: there are fewer than four samples, the times do not increase from 0, a
            number is not finite, or an array does not have one row for each time.
    """
    times = _array("times", table.times, None)
    count = times.shape[0]
    if count < FEWEST_SAMPLES:
        raise TrajectoryError(f"a table needs at least {FEWEST_SAMPLES} samples, not {count}")
    if times[0] != 0.0 or not (np.diff(times) > 0.0).all():
        raise TrajectoryError(
            "the times of a table must increase from 0 s; subtract the first time from all times"
        )
    return replace(
        table,
        times=times,
        position=_array("position", table.position, (count, 3)),
        derivatives=tuple(
            _array(name, values, (count, 3))
            for name, values in zip(("velocity", "acceleration"), table.derivatives, strict=False)
        ),
        yaw=None if table.yaw is None else _array("yaw", table.yaw, (count,)),
    )


def _array(name: str, values: ArrayLike, shape: tuple[int, ...] | None) -> Floats:
    """Convert `values` to an array of finite floats; messages call it `name`.

    `shape`: the required one; None: one dimension of any length.

    Raises:
        TrajectoryError: `values` have another shape, or a value is no finite number.
    """
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise TrajectoryError(f"{name} must be an array of numbers: {error}") from error
    if array.ndim != 1 if shape is None else array.shape != shape:
        raise TrajectoryError(f"{name} must have the shape {shape or '(m,)'}, not {array.shape}")
    if not np.isfinite(array).all():
        raise TrajectoryError(f"{name} has a number that is not finite")
    return array
