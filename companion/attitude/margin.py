"""How much feedback a rate loop with dead time and lag bears."""

from math import atan, inf, pi, sqrt


def largest_gain(lag: float, dead_time: float) -> float:
    """Largest stable gain (1/s) of an integrator behind e^(−θs)/(τs + 1); both times in s.

    At the frequency ω where ωθ + atan(ωτ) = π/2 the loop k·e^(−jωθ)/(jω(1 + jωτ)) has turned by
    half a circle; it is stable while its magnitude is below 1 there, so k = ω·√(1 + ω²τ²). Without
    a dead time every gain is stable.
    """
    if dead_time <= 0.0:
        return inf
    low, high = 0.0, 0.5 * pi / dead_time
    for _ in range(60):
        middle = 0.5 * (low + high)
        if middle * dead_time + atan(middle * lag) < 0.5 * pi:
            low = middle
        else:
            high = middle
    return low * sqrt(1.0 + low * low * lag * lag)
