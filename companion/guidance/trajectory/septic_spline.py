"""Splines of polynomials of degree 7, given by value and three derivatives at each knot."""

from bisect import bisect_right
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

STATE_SIZE = 4
"""Size of the state at a knot: the value and its first three derivatives."""

_POLYNOMIAL_DEGREE = 2 * STATE_SIZE - 1


def derivative_rows(fractions: Floats, derivative: int) -> Floats:
    """Rows (n, 8): derivatives, all of one order, of 1, u, … u⁷ at fractions u (n,) of a piece."""
    rows = np.zeros((fractions.size, _POLYNOMIAL_DEGREE + 1))
    for power in range(derivative, _POLYNOMIAL_DEGREE + 1):
        factor = np.prod(np.arange(power - derivative + 1, power + 1))
        rows[:, power] = factor * fractions ** (power - derivative)
    return rows


def _coefficients_from_ends() -> Floats:
    """Matrix (8, 8) from the states at u = 0 and u = 1 to the coefficients of 1, u, … u⁷."""
    ends = [derivative_rows(np.array([u]), k)[0] for u in (0.0, 1.0) for k in range(STATE_SIZE)]
    return np.round(np.linalg.inv(np.array(ends)) * 6.0) / 6.0


COEFFICIENTS_FROM_ENDS = _coefficients_from_ends()
"""Matrix (8, 8) from the states at both ends of a piece to its coefficients. Its entries are
exact: multiples of 1/6."""


class SepticSpline:
    """Septic pieces between knots, three times continuously differentiable by construction."""

    def __init__(self, knots: Floats, states: Floats) -> None:
        """Compute the polynomial of each piece from the states at both ends.

        Args:
            knots: (k,), times of the knots, increasing, s.
            states: (k, 4, n): value, first, second and third derivative of n series at each knot.
        """
        spans = np.diff(knots)
        scale = spans[:, None] ** np.arange(STATE_SIZE)
        ends = np.concatenate(
            (states[:-1] * scale[:, :, None], states[1:] * scale[:, :, None]), axis=1
        )
        scaled_pieces = np.einsum("ij,kjn->kni", COEFFICIENTS_FROM_ENDS, ends)
        pieces = scaled_pieces / (spans[:, None, None] ** np.arange(_POLYNOMIAL_DEGREE + 1))
        self._arrays = knots, pieces
        self._knots: list[float] = knots.tolist()
        self._pieces: list[list[list[float]]] = pieces.tolist()

    @property
    def begin(self) -> float:
        """The first knot, s."""
        return self._knots[0]

    @property
    def end(self) -> float:
        """The last knot, s."""
        return self._knots[-1]

    def at(self, time: float) -> list[tuple[float, float, float, float]]:
        """Value, first, second and third derivative of each series, as Python floats."""
        index = min(max(bisect_right(self._knots, time) - 1, 0), len(self._pieces) - 1)
        u = time - self._knots[index]
        return [_horner(piece, u) for piece in self._pieces[index]]

    def sampled(self, times: Floats) -> Floats:
        """Like `at`, for many `times` (m,) at once; returns (m, n, 4)."""
        knots, pieces = self._arrays
        index = np.clip(np.searchsorted(knots, times, side="right") - 1, 0, len(pieces) - 1)
        u = (times - knots[index])[:, None]
        return np.stack(_horner(np.moveaxis(pieces[index], -1, 0), u), axis=-1)

    @property
    def knots(self) -> Floats:
        """Times of all knots, (k,), s."""
        return self._arrays[0]


def _horner(c: Any, u: Any) -> tuple[Any, Any, Any, Any]:
    """Value and first three derivatives of c₀ + c₁u + … + c₇u⁷; for floats and arrays."""
    c0, c1, c2, c3, c4, c5, c6, c7 = c
    return (
        ((((((c7 * u + c6) * u + c5) * u + c4) * u + c3) * u + c2) * u + c1) * u + c0,
        (((((7 * c7 * u + 6 * c6) * u + 5 * c5) * u + 4 * c4) * u + 3 * c3) * u + 2 * c2) * u + c1,
        ((((42 * c7 * u + 30 * c6) * u + 20 * c5) * u + 12 * c4) * u + 6 * c3) * u + 2 * c2,
        (((210 * c7 * u + 120 * c6) * u + 60 * c5) * u + 24 * c4) * u + 6 * c3,
    )
