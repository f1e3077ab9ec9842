"""The septic spline of minimum snap through fixed states and near observed values.

Minimum snap means the smallest integral of squared snap: Mellinger & Kumar, Minimum snap trajectory
generation and control for quadrotors, ICRA 2011. The unknowns are the states at the knots (Richter,
Bry & Roy 2013). Each piece joins two neighbouring knots, so the equations are block-tridiagonal,
and the work is proportional to the number of knots.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from companion.guidance.trajectory.septic_spline import (
    COEFFICIENTS_FROM_ENDS,
    STATE_SIZE,
    Floats,
    SepticSpline,
    derivative_rows,
)

_SMALLEST_EIGENVALUE = 1e-13
"""The spline is undetermined if an eigenvalue of the scaled last pivot is smaller than this."""


class FixedStates(NamedTuple):
    """States that the spline must meet exactly.

    Attributes:
        states: (k, 4, n), value and three derivatives of n series at each knot.
        mask: (k, 4), true for each value or derivative that is fixed.
    """

    states: Floats
    mask: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Observations:
    """Values that the spline approximates.

    Attributes:
        times: (m,), time of each observation, s.
        values: (m, n), observed values of n series.
        weights: (m,), weights of the squared differences.
        derivative: which derivative was observed; 0 is the value.
    """

    times: Floats
    values: Floats
    weights: Floats
    derivative: int = 0


class _Equations(NamedTuple):
    """A symmetric block-tridiagonal system.

    Attributes:
        diagonal: (k, 4, 4), blocks on the diagonal.
        upper: (k−1, 4, 4), blocks to the right of the diagonal.
        right: (k, 4, n), right-hand side.
    """

    diagonal: Floats
    upper: Floats
    right: Floats


def minimum_snap(
    knots: Floats,
    fixed: FixedStates,
    observations: tuple[Observations, ...] = (),
    stiffness: float = 1.0,
) -> SepticSpline:
    """The spline that minimises stiffness·∫ snap² dt + Σ weight·residual².

    Args:
        knots: (k,), times of the knots, increasing, s.
        fixed: states that the spline meets exactly.
        observations: values that the spline approximates, at times between the knots.
        stiffness: weight of the integral.

    Raises:
        numpy.linalg.LinAlgError: the fixed and observed values do not determine the spline.
    """
    # In units of the mean span, the entries (powers of spans up to the seventh) stay near 1.
    mean_span = float((knots[-1] - knots[0]) / (knots.size - 1))
    spans = np.diff(knots) / mean_span
    equations = _smoothness_equations(spans, stiffness / mean_span**7, fixed.states.shape[2])
    for observed in observations:
        _add_observations(equations, knots, spans, mean_span, observed)
    scale = mean_span ** np.arange(STATE_SIZE)
    states = _optimal_states(equations, fixed.states * scale[:, None], fixed.mask)
    return SepticSpline(knots, states / scale[:, None])


def _smoothness_equations(spans: Floats, stiffness: float, series: int) -> _Equations:
    """Half the gradient of the integral of squared snap."""
    powers = np.arange(STATE_SIZE)
    # Snap of uᵏ is k!/(k−4)!·uᵏ⁻⁴, and ∫ uᵐ over a piece is 1/(m + 1).
    snap = np.array([24.0, 120.0, 360.0, 840.0])
    energy = np.outer(snap, snap) / (powers[:, None] + powers + 1.0)
    high_coefficients = COEFFICIENTS_FROM_ENDS[STATE_SIZE:]  # coefficients of u⁴ to u⁷
    block = high_coefficients.T @ energy @ high_coefficients
    ends = spans[:, None] ** np.tile(powers, 2)
    blocks = stiffness * block * ends[:, :, None] * ends[:, None, :] / spans[:, None, None] ** 7
    diagonal = np.zeros((spans.size + 1, STATE_SIZE, STATE_SIZE))
    diagonal[:-1] += blocks[:, :STATE_SIZE, :STATE_SIZE]
    diagonal[1:] += blocks[:, STATE_SIZE:, STATE_SIZE:]
    return _Equations(
        diagonal,
        blocks[:, :STATE_SIZE, STATE_SIZE:].copy(),
        np.zeros((spans.size + 1, STATE_SIZE, series)),
    )


def _add_observations(
    equations: _Equations, knots: Floats, spans: Floats, mean_span: float, observed: Observations
) -> None:
    """Add half the gradient of the weighted squares of the residuals."""
    piece = np.clip(np.searchsorted(knots, observed.times, side="right") - 1, 0, spans.size - 1)
    span = spans[piece]
    fractions = (observed.times - knots[piece]) / (span * mean_span)
    ends = span[:, None] ** np.tile(np.arange(STATE_SIZE), 2)
    rows = derivative_rows(fractions, observed.derivative) @ COEFFICIENTS_FROM_ENDS * ends
    rows /= (span[:, None] * mean_span) ** observed.derivative
    weighted = rows * observed.weights[:, None]
    squares = weighted[:, :, None] * rows[:, None, :]
    moments = weighted[:, :, None] * observed.values[:, None, :]
    np.add.at(equations.diagonal, piece, squares[:, :STATE_SIZE, :STATE_SIZE])
    np.add.at(equations.diagonal, piece + 1, squares[:, STATE_SIZE:, STATE_SIZE:])
    np.add.at(equations.upper, piece, squares[:, :STATE_SIZE, STATE_SIZE:])
    np.add.at(equations.right, piece, moments[:, :STATE_SIZE])
    np.add.at(equations.right, piece + 1, moments[:, STATE_SIZE:])


def _optimal_states(equations: _Equations, states: Floats, mask: NDArray[np.bool_]) -> Floats:
    """The states (k, 4, n) of smallest cost that equal `states` where `mask` is true."""
    fixed = np.where(mask[:, :, None], states, 0.0)
    diagonal, upper, right = equations
    right = right - diagonal @ fixed
    right[:-1] -= upper @ fixed[1:]
    right[1:] -= upper.transpose(0, 2, 1) @ fixed[:-1]
    right[mask] = fixed[mask]
    is_free = ~mask
    diagonal = diagonal * (is_free[:, :, None] & is_free[:, None, :]) + mask[:, :, None] * np.eye(
        STATE_SIZE
    )
    upper = upper * (is_free[:-1, :, None] & is_free[1:, None, :])
    return _solve_block_tridiagonal(diagonal, upper, right)


def _solve_block_tridiagonal(diagonal: Floats, upper: Floats, right: Floats) -> Floats:
    """Solve a symmetric positive definite block-tridiagonal system by Gaussian elimination.

    Raises:
        numpy.linalg.LinAlgError: the system is not positive definite.
    """
    scale = 1.0 / np.sqrt(np.einsum("kii->ki", diagonal))
    diagonal = diagonal * scale[:, :, None] * scale[:, None, :]
    upper = upper * scale[:-1, :, None] * scale[1:, None, :]
    right = right * scale[:, :, None]
    reduced_upper = np.empty_like(upper)
    pivot = diagonal[0]
    for k in range(len(upper)):
        solved = np.linalg.solve(pivot, np.concatenate((upper[k], right[k]), axis=1))
        reduced_upper[k], right[k] = solved[:, :STATE_SIZE], solved[:, STATE_SIZE:]
        pivot = diagonal[k + 1] - upper[k].T @ reduced_upper[k]
        right[k + 1] -= upper[k].T @ right[k]
    if np.linalg.eigvalsh(pivot)[0] < _SMALLEST_EIGENVALUE:
        raise np.linalg.LinAlgError("the spline is not determined: too few of its values are given")
    right[-1] = np.linalg.solve(pivot, right[-1])
    for k in range(len(upper) - 1, -1, -1):
        right[k] -= reduced_upper[k] @ right[k + 1]
    states: Floats = right * scale[:, :, None]
    return states
