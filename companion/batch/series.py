"""Elementary functions as polynomials that a compiler can vectorise over many vehicles.

A call of the C library takes one number and prevents vectorising the loop around it. The functions
here have no branches and are within 5e-15 of the C library on their domains. Terms are added in
pairs (Estrin's scheme), because with Horner's scheme each term waits for the one before.
"""

from collections.abc import Callable
from math import nan
from typing import Any

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial
from numpy.typing import NDArray

LARGEST_SQUARE = 0.25
"""Largest argument of `cos_and_sinc`, rad²: (0.5 rad)², for turns of at most 1 rad per sample."""


def _polynomial_fit(
    function: Callable[[NDArray[np.float64]], Any], largest_argument: float, terms: int
) -> tuple[float, ...]:
    """Coefficients, constant first, of the polynomial through the Chebyshev points of [0, largest].

    The error of this polynomial is at most a small multiple of the error of the best polynomial.
    """
    fit = Chebyshev.interpolate(function, terms - 1, domain=[0.0, largest_argument])
    return tuple(float(c) for c in fit.convert(kind=Polynomial).coef)


_ARCTANGENT = _polynomial_fit(lambda u: np.arctan(np.sqrt(u)) / np.sqrt(u), 1.0, 18)
_COSINE = _polynomial_fit(lambda u: np.cos(np.sqrt(u)), LARGEST_SQUARE, 6)
_SINC = _polynomial_fit(lambda u: np.sin(np.sqrt(u)) / np.sqrt(u), LARGEST_SQUARE, 6)


def arctangent(t: float) -> float:
    """atan(t) in rad for t in [−1, 1]; the laws use it for half angles only."""
    u = t * t
    u2 = u * u
    u4 = u2 * u2
    u6 = u4 * u2
    low_terms = _six_terms(u, u2, u4, *_ARCTANGENT[:6])
    middle_terms = _six_terms(u, u2, u4, *_ARCTANGENT[6:12])
    high_terms = _six_terms(u, u2, u4, *_ARCTANGENT[12:])
    return t * (low_terms + u6 * (middle_terms + u6 * high_terms))


def cos_and_sinc(h_squared: float) -> tuple[float, float]:
    """cos(h) and sin(h)/h for h² from 0 to `LARGEST_SQUARE`; replaces `rotation.cos_and_sinc`.

    A larger h² gives NaN. The attitude then stays NaN, and the caller detects that.
    """
    h_squared = h_squared if h_squared <= LARGEST_SQUARE else nan
    h_fourth = h_squared * h_squared
    h_eighth = h_fourth * h_fourth
    return (
        _six_terms(h_squared, h_fourth, h_eighth, *_COSINE),
        _six_terms(h_squared, h_fourth, h_eighth, *_SINC),
    )


def _six_terms(
    u: float,
    u2: float,
    u4: float,
    c0: float,
    c1: float,
    c2: float,
    c3: float,
    c4: float,
    c5: float,
) -> float:
    """Σ c_k·u^k for k from 0 to 5; u2 is u², u4 is u⁴."""
    return ((c0 + u * c1) + u2 * (c2 + u * c3)) + u4 * (c4 + u * c5)
