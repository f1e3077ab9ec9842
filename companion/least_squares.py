"""Least squares in which few unknowns are not linear: the linear ones are eliminated at each step.

Golub & Pereyra's variable projection, with Levenberg–Marquardt steps over what remains.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Projection = Callable[[Floats], tuple[Floats, Floats]]
"""From the (k,) unknowns that are not linear to the best weights (c,) and the residual (m,)."""

_STEP = 1e-4
_ENOUGH = 1e-9
_MOST_STEPS = 60


class Solution(NamedTuple):
    """Where the sum of squares is smallest.

    Attributes:
        unknown: (k,), the unknowns that are not linear.
        weights: (c,), the linear ones.
        residual: (m,), measured − modelled.
        slopes: (m, k), how the residual changes with each of `unknown`, the weights at their best.
    """

    unknown: Floats
    weights: Floats
    residual: Floats
    slopes: Floats

    @property
    def squares(self) -> float:
        """Sum of the squared residuals."""
        return float(self.residual @ self.residual)


def project(columns: Floats, measured: Floats) -> tuple[Floats, Floats]:
    """Least-squares weights of the columns (m, c) for `measured`, and the residual.

    Args:
        columns: (m, c).
        measured: (m,), or (m, k) for k series at once; the weights are (c,) or (c, k) then.
    """
    weights = np.asarray(np.linalg.lstsq(columns, measured, rcond=None)[0], dtype=np.float64)
    residual: Floats = measured - columns @ weights
    return weights, residual


def minimise(projection: Projection, start: Floats, lowest: Floats, highest: Floats) -> Solution:
    """Levenberg–Marquardt from `start`, kept between `lowest` and `highest` (each (k,)).

    Args:
        projection: what is left where the linear unknowns are at their best.
        start: (k,), scaled so that a change of 1e-4 is small and felt.
        lowest: (k,).
        highest: (k,).
    """
    unknown, damping = np.clip(start, lowest, highest), 1e-3
    weights, residual = projection(unknown)
    for _ in range(_MOST_STEPS):
        slopes = _slopes(projection, unknown)
        curvature, descent = slopes.T @ slopes, -(slopes.T @ residual)
        stiff = curvature + damping * np.diag(np.diagonal(curvature) + 1e-12)
        trial = np.clip(unknown + np.linalg.solve(stiff, descent), lowest, highest)
        trial_weights, trial_residual = projection(trial)
        gained = float(residual @ residual - trial_residual @ trial_residual)
        moved = float(np.abs(trial - unknown).max())
        if gained > 0.0:
            unknown, weights, residual = trial, trial_weights, trial_residual
            damping = max(0.2 * damping, 1e-9)
        else:
            damping *= 5.0
        if moved < 1e-7 or 0.0 < gained < _ENOUGH * float(residual @ residual):
            break
    return Solution(unknown, weights, residual, _slopes(projection, unknown))


def _slopes(projection: Projection, unknown: Floats) -> Floats:
    """(m, k), how the projected residual changes with each unknown: central differences."""
    steps = _STEP * np.eye(unknown.size)
    return np.stack(
        [
            (projection(unknown + step)[1] - projection(unknown - step)[1]) / (2.0 * _STEP)
            for step in steps
        ],
        axis=1,
    )
