"""Noise that changes slowly: a first-order Gauss-Markov process."""

from math import sqrt
from random import Random


def next_slow_noise(random: Random, noise: float, deviation: float, decay: float) -> float:
    """Return the next value of a slow noise.

    Args:
        random: generator of normal numbers.
        noise: the present value.
        deviation: standard deviation of the noise.
        decay: correlation of the next value with the present one, 0 to 1.
    """
    return decay * noise + random.gauss(0.0, deviation * sqrt(1.0 - decay * decay))
