"""A slower time law: stretches a trajectory's time by a factor that changes smoothly."""

import itertools
from bisect import bisect_right
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from companion.guidance.trajectory.septic_spline import Floats
from companion.guidance.trajectory.time_laws import Progress

_MOST_NEWTON_STEPS = 20
_NEWTON_TOLERANCE = 1e-14
"""Tolerance of Newton's method, as a share of a piece."""

Number = Any
"""A number, or an array of them."""


class _Piece(NamedTuple):
    """One piece of the stretch factor w as a polynomial in u, 0..1: a + b·u + c·u² + d·u³."""

    a: Number
    b: Number
    c: Number
    d: Number

    def factor(self, u: Number) -> Number:
        """The factor w by which time is stretched, at u."""
        return self.a + u * (self.b + u * (self.c + u * self.d))

    def slope(self, u: Number) -> Number:
        """Derivative dw/du."""
        return self.b + u * (2.0 * self.c + u * 3.0 * self.d)

    def curvature(self, u: Number) -> Number:
        """Second derivative d²w/du²."""
        return 2.0 * self.c + 6.0 * self.d * u

    def integral(self, u: Number) -> Number:
        """∫ w du from 0 to u: stretched time up to u, divided by the piece's original duration."""
        return u * (self.a + u * (self.b / 2.0 + u * (self.c / 3.0 + u * self.d / 4.0)))


def _spline_piece(p: Number, q: Number, r: Number, s: Number) -> _Piece:
    """The piece between four coefficients of a uniform cubic B-spline."""
    return _Piece(
        (p + 4.0 * q + r) / 6.0,
        (r - p) / 2.0,
        (p - 2.0 * q + r) / 2.0,
        (s - p + 3.0 * (q - r)) / 6.0,
    )


@dataclass(frozen=True)
class SlowerTime:
    """The original time σ of a trajectory over the stretched time t: dt/dσ = w(σ).

    The stretch factor w is a uniform cubic B-spline. Its second derivative is continuous, so the
    slowed trajectory has a continuous jerk if the original one has. In each piece, w lies between
    the smallest and the largest of the piece's four coefficients.

    Attributes:
        original_duration: duration of the original trajectory, s.
        coefficients: B-spline coefficients of w, three more than there are pieces. Equal
            coefficients stretch time evenly.
    """

    original_duration: float
    coefficients: tuple[float, ...]

    @cached_property
    def _pieces(self) -> list[_Piece]:
        """The pieces, cached because a flight reads them several times in each sample."""
        c = self.coefficients
        return list(itertools.starmap(_spline_piece, zip(c, c[1:], c[2:], c[3:], strict=False)))

    @cached_property
    def _integrals(self) -> list[float]:
        """`_Piece.integral` over each whole piece."""
        return [float(piece.integral(1.0)) for piece in self._pieces]

    @cached_property
    def _ends(self) -> list[float]:
        """Stretched times at the ends of the pieces, beginning with 0, s."""
        ends: list[float] = np.cumsum(np.array(self._integrals) * self._piece_duration).tolist()
        return [0.0, *ends]

    @property
    def _piece_duration(self) -> float:
        """Original time of one piece, s."""
        return self.original_duration / (len(self.coefficients) - 3)

    @property
    def duration(self) -> float:
        """Duration of the slowed trajectory, s."""
        return self._ends[-1]

    def at(self, time: float) -> Progress:
        """Original time at the stretched `time`, and its derivatives; limited to the duration."""
        if time <= 0.0:
            return self._progress(self._pieces[0], 0.0, 0.0)
        last = len(self.coefficients) - 4
        if time >= self.duration:
            return self._progress(self._pieces[last], 1.0, last)
        index = min(bisect_right(self._ends, time) - 1, last)
        piece = self._pieces[index]
        integral = (time - self._ends[index]) / self._piece_duration
        u = integral / self._integrals[index]
        for _ in range(_MOST_NEWTON_STEPS):
            step = (float(piece.integral(u)) - integral) / float(piece.factor(u))
            u = min(max(u - step, 0.0), 1.0)
            if abs(step) < _NEWTON_TOLERANCE:
                break
        return self._progress(piece, u, index)

    def stretched_times(self, original_times: Floats) -> tuple[Floats, Progress]:
        """Stretched times and progress (m,) at `original_times` (m,), s."""
        count = len(self.coefficients) - 3
        index = np.clip((original_times / self._piece_duration).astype(int), 0, count - 1)
        c = np.array(self.coefficients)
        piece = _spline_piece(c[index], c[index + 1], c[index + 2], c[index + 3])
        u = original_times / self._piece_duration - index
        times = np.array(self._ends)[index] + self._piece_duration * np.asarray(piece.integral(u))
        return times, self._progress(piece, u, index)

    def _progress(self, piece: _Piece, u: Number, index: Number) -> Progress:
        """Original time and its derivatives at `u` (0..1) of the piece with this index.

        With r = 1/w: ṙ = −w'/w³ and r̈ = −w''/w⁴ + 3w'²/w⁵.
        """
        piece_duration = self._piece_duration
        w, slope = piece.factor(u), piece.slope(u) / piece_duration
        curvature = piece.curvature(u) / (piece_duration * piece_duration)
        rate = 1.0 / w
        cube = rate * rate * rate
        return Progress(
            piece_duration * (index + u),
            rate,
            -slope * cube,
            cube * rate * (3.0 * slope * slope * rate - curvature),
        )
