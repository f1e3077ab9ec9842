"""A first-order lag over one sample, exact while what it follows is held."""

from math import exp


def behind(rate: float, aim: float, lag: float, dt: float) -> tuple[float, float]:
    """How far a rate moves on within `dt` on its way to `aim`, and the rate then.

    lag·ṙ = aim − r; `lag` and `dt` in s, the way in the rate's unit times s.
    """
    kept = exp(-dt / lag)
    return aim * dt + (rate - aim) * lag * (1.0 - kept), aim + (rate - aim) * kept
