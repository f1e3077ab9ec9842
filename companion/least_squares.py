"""Least squares with linear and a few nonlinear unknowns; the linear ones are eliminated.

The method is the variable projection of Golub & Pereyra, with Levenberg–Marquardt steps over the
nonlinear unknowns.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Projection = Callable[[Floats], tuple[Floats, Floats]]
"""Takes the nonlinear unknowns (k,); returns the best weights (c,) and the residual (m,)."""

_DIFFERENCE_STEP = 1e-4
"""Step of the central differences."""
_SMALLEST_REDUCTION = 1e-9
"""The search ends when a step reduces the sum of squares by less than this share, or changes every
nonlinear unknown by less than 1e-7."""
_MOST_STEPS = 60


class Solution(NamedTuple):
    """The unknowns with the smallest sum of squares that was found."""

    unknowns: Floats
    """Values of the nonlinear unknowns, (k,)."""
    weights: Floats
    """Values of the linear unknowns, (c,)."""
    residual: Floats
    """Measured minus modelled values, (m,)."""
    jacobian: Floats
    """Jacobian of the residual with respect to `unknowns`, (m, k), with the weights fitted again at
    each value of `unknowns`."""

    @property
    def rss(self) -> float:
        """Residual sum of squares."""
        return float(self.residual @ self.residual)


def project(columns: Floats, measured: Floats) -> tuple[Floats, Floats]:
    """Least-squares weights of the columns (m, c) for `measured`, and the residual.

    Args:
        columns: (m, c).
        measured: (m,), or (m, k) for k series at once; then the weights are (c, k), not (c,).
    """
    weights = np.asarray(np.linalg.lstsq(columns, measured, rcond=None)[0], dtype=np.float64)
    residual: Floats = measured - columns @ weights
    return weights, residual


def minimise(
    projection: Projection, start: Floats, lower_bounds: Floats, upper_bounds: Floats
) -> Solution:
    """Minimise the sum of squares by Levenberg–Marquardt steps from `start`, within bounds.

    The minimum may be a local one. The search ends after 60 steps at the latest.

    Args:
        projection: eliminates the linear unknowns; also called up to 1e-4 outside the bounds.
        start: (k,), scaled so that a change of 1e-4 is small but has an effect.
        lower_bounds: (k,), lower bounds.
        upper_bounds: (k,), upper bounds.
    """
    unknowns, damping = np.clip(start, lower_bounds, upper_bounds), 1e-3
    weights, residual = projection(unknowns)
    jacobian = _jacobian(projection, unknowns)
    for _ in range(_MOST_STEPS):
        curvature, descent = jacobian.T @ jacobian, -(jacobian.T @ residual)
        damped_curvature = curvature + damping * np.diag(np.diagonal(curvature) + 1e-12)
        trial_unknowns = np.clip(
            unknowns + np.linalg.solve(damped_curvature, descent), lower_bounds, upper_bounds
        )
        trial_weights, trial_residual = projection(trial_unknowns)
        reduction = float(residual @ residual - trial_residual @ trial_residual)
        largest_change = float(np.abs(trial_unknowns - unknowns).max())
        if reduction > 0.0:
            unknowns, weights, residual = trial_unknowns, trial_weights, trial_residual
            jacobian = _jacobian(projection, unknowns)
            damping = max(0.2 * damping, 1e-9)
        else:
            damping *= 5.0
        least_reduction = _SMALLEST_REDUCTION * float(residual @ residual)
        if largest_change < 1e-7 or 0.0 < reduction < least_reduction:
            break
    return Solution(unknowns, weights, residual, jacobian)


def _jacobian(projection: Projection, unknowns: Floats) -> Floats:
    """Jacobian of the residual of `projection` by central differences, (m, k)."""
    steps = _DIFFERENCE_STEP * np.eye(unknowns.size)
    return np.stack(
        [
            (projection(unknowns + step)[1] - projection(unknowns - step)[1])
            / (2.0 * _DIFFERENCE_STEP)
            for step in steps
        ],
        axis=1,
    )
