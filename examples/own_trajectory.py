"""Write a trajectory of your own, check it against limits, and slow it down until it keeps them.

This one hops over an obstacle. docs/extending.md says what each member of the class means.

Run: python examples/own_trajectory.py
"""

from math import radians

from numpy.polynomial import Polynomial

from companion.guidance.trajectory import Envelope, Sample, slow_down, violations


class Hop:
    """8 m north, with a climb of 2 m on the way, from rest to rest; NED, relative to the start."""

    name = "hop"
    holds_heading = True  # the heading at the start; `heading` of a sample is then 0

    def __init__(self, duration: float) -> None:
        self.duration = duration
        s = Polynomial([0.0, 1.0 / duration])
        north, up = 8.0 * s**4 * (35 - 84 * s + 70 * s**2 - 20 * s**3), 2.0 * 256 * (s - s**2) ** 4
        self._axes = [[axis.deriv(k) for axis in (north, Polynomial([0.0]), -up)] for k in range(4)]

    def at(self, time: float) -> Sample:
        """Position, velocity, acceleration and jerk `time` seconds after the start."""
        t = min(max(time, 0.0), self.duration)
        return Sample(*(tuple(float(axis(t)) for axis in row) for row in self._axes), 0.0, 0.0)

    def check_times(self) -> list[float]:
        """Times at which the limits are checked, s."""
        return [self.duration * k / 500 for k in range(501)]


limits = Envelope(max_tilt=radians(25.0), max_tilt_rate=radians(90.0), max_climb=2.5)
print("in 3 s:", *violations(Hop(3.0), limits), sep="\n  ")
slowed = slow_down(Hop(3.0), limits)
print(f"slowed down it lasts {slowed.trajectory.duration:.2f} s, for {slowed.parts[0].limit}")
