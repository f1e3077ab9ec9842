"""How much feedback a rate loop with dead time and lag bears."""

from math import atan2, hypot, inf, pi, sqrt


def largest_gain(lag: float, dead_time: float, square: float = 0.0) -> float:
    """Largest stable gain (1/s) of an integrator behind e^(−θs)/(σs² + τs + 1).

    At the frequency ω where ωθ + ∠(1 − σω² + jωτ) = π/2 the loop has turned by half a circle; it is
    stable while its magnitude is below 1 there, so k = ω·|1 − σω² + jωτ|. Without a dead time every
    gain is stable behind a lag of first order.

    Args:
        lag: τ, s.
        dead_time: θ, s.
        square: σ, s²; 0 for a lag of first order.
    """
    if dead_time <= 0.0 and square <= 0.0:
        return inf
    low, high = 0.0, 0.5 * pi / dead_time if dead_time > 0.0 else inf
    if square > 0.0:
        high = min(high, 1.0 / sqrt(square))  # there the lag alone has turned by as much
    for _ in range(60):
        middle = 0.5 * (low + high)
        if middle * dead_time + atan2(middle * lag, 1.0 - square * middle * middle) < 0.5 * pi:
            low = middle
        else:
            high = middle
    return low * hypot(1.0 - square * low * low, low * lag)
