"""Numbers that arithmetic cannot take end in a sentence, not in a warning or an internal error."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from companion.guidance.trajectory.sample import TrajectoryError


@contextmanager
def computable() -> Iterator[None]:
    """Turn what overflows, or determines nothing, into an error for the user.

    The ranges of files exclude what is known to; this is for what nobody thought of.

    Raises:
        TrajectoryError: an overflow, a division by zero, equations without a solution.
    """
    try:
        with np.errstate(over="raise", divide="raise", invalid="raise"):
            yield
    except (ArithmeticError, np.linalg.LinAlgError) as error:
        raise TrajectoryError(
            "its numbers cannot be computed with: they are too large, too small or too far apart"
        ) from error
