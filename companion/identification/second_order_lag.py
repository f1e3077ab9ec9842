"""Exact response of a second-order loop to commands in straight pieces.

ẍ = ω²·(v − x) − 2ζω·ẋ has the lags τ = 1/(ω·(ζ ± √(ζ² − 1))), and by partial fractions
x = (τ₁·x₁ − τ₂·x₂)/(τ₁ − τ₂) with xᵢ the response of the lag τᵢ alone.
"""

from math import copysign, sqrt

import numpy as np
from numpy.typing import NDArray

from companion.identification.first_order_lag import Knots, lagged, lagged_by

Floats = NDArray[np.float64]

_NEARLY_CRITICAL = 1e-6
"""Nearer to ζ² = 1 the two lags would be one, and their difference 0."""


def second_order(commands: Knots, frequency: float, damping: float, at: Floats) -> Floats:
    """What the loop makes of the commands at the times (m,), begun at rest.

    Args:
        commands: none of `at` may lie before the first knot.
        frequency: ω, rad/s.
        damping: ζ.
        at: (m,), s.
    """
    first, second = _lags(frequency, damping)
    if first.imag:
        oscillating: Floats = np.imag(first * lagged_by(commands, first, at)) / first.imag
        return oscillating
    slow, quick = first.real, second.real
    by_slow, by_quick = lagged(commands, slow, at), lagged(commands, quick, at)
    return (slow * by_slow - quick * by_quick) / (slow - quick)


def second_order_decay(since: Floats, frequency: float, damping: float) -> Floats:
    """(m, 2), how the state at the start dies away, `since` (m,) seconds later."""
    first, second = _lags(frequency, damping)
    if first.imag:
        turning = np.exp(-since / first)
        return np.column_stack((np.real(turning), np.imag(turning)))
    slow, quick = np.exp(-since / first.real), np.exp(-since / second.real)
    # The second as a difference, so that the two stay apart near critical damping.
    return np.column_stack((slow, (slow - quick) / (first.real - second.real)))


def _lags(frequency: float, damping: float) -> tuple[complex, complex]:
    apart = damping * damping - 1.0
    apart = copysign(max(abs(apart), _NEARLY_CRITICAL), apart)
    root = complex(0.0, sqrt(-apart)) if apart < 0.0 else complex(sqrt(apart))
    return 1.0 / (frequency * (damping - root)), 1.0 / (frequency * (damping + root))
