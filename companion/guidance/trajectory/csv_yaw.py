"""The heading of a CSV table's samples, from its yaw or its quaternion."""

from collections.abc import Mapping

import numpy as np

from companion.guidance.trajectory.sample import TrajectoryError
from companion.guidance.trajectory.septic_spline import Floats

_LARGEST_YAW_STEP = 6.5
"""Largest change of yaw between two rows, rad: a bit more than 2π, by which a wrapped yaw jumps."""

_LARGEST_FIRST_YAW = 6.5
"""Largest magnitude of the first yaw, rad: a bit over a turn. A larger number is in degrees."""


def yaw_of(data: Mapping[str, Floats], name: str) -> Floats | None:
    """Tilt-yaw heading (m,), rad, from the yaw column, else from the quaternion.

    Args:
        data: values (m, columns) of the table by quantity, such as "yaw".
        name: the file's name, for error messages.

    Raises:
        TrajectoryError: the first yaw, or the change between two rows, is more than a turn.
    """
    if "yaw" in data:
        yaw = data["yaw"][:, 0]
        if abs(yaw[0]) > _LARGEST_FIRST_YAW:
            raise TrajectoryError(
                f"{name}: yaw begins at {yaw[0]:.4g} rad, more than a turn; if the column is in "
                "degrees, convert it to rad, else subtract whole turns"
            )
        largest_step = float(np.abs(np.diff(yaw)).max())
        if largest_step > _LARGEST_YAW_STEP:
            raise TrajectoryError(
                f"{name}: yaw changes by {largest_step:.4g} rad between two rows; if the column "
                "is in degrees, convert it to rad"
            )
        return np.unwrap(yaw)
    if "quaternion" in data:
        q = data["quaternion"]
        return np.unwrap(2.0 * np.arctan2(q[:, 3], q[:, 0]))
    return None
