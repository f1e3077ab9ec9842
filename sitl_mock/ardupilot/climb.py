"""A climb rate asked, turned into a height to follow: the rate changes no faster than a limit."""

from math import sqrt


class Climb:
    """The height, climb rate and acceleration that are followed now; SI, up positive."""

    def __init__(self) -> None:
        self.height = 0.0
        self.rate = 0.0
        self.acceleration = 0.0

    def begin(self, height: float, rate: float) -> None:
        """Begin where the vehicle is, as fast as it climbs."""
        self.height = height
        self.rate = rate
        self.acceleration = 0.0

    def step(self, asked: float, acceleration: float, dt: float) -> None:
        """Move on by ``dt`` s towards the climb rate ``asked``."""
        most = acceleration * dt
        change = max(-most, min(most, asked - self.rate))
        self.acceleration = change / dt
        self.rate += change
        self.height += self.rate * dt


def approach(way: float, acceleration: float, fastest: float) -> float:
    """Return the speed from which ``acceleration`` still stops within the ``way``, m/s."""
    return min(fastest, sqrt(2.0 * acceleration * max(0.0, way)))
