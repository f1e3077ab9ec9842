"""The drag there is, learned from how the vehicle slows down against what its thrust gives."""

from math import exp

from companion.guidance.horizontal import Horizontal

_MEMORY = 20.0
"""What is older counts ever less, s."""
_PRIOR = 20.0
"""What the configured drag counts as, in (m/s)² of moving about, a sample each."""
_LARGEST = 2.0
"""By so much the drag may be larger than the configured one, 1/s."""
_TOLD = 300.0
"""So much moving about tells it well enough to speak of it, in the unit of `_PRIOR`."""


class DragEstimate:
    """Least squares of v̇ − thrust = wind − drag·v over the last moments, north and east alike.

    The steady part is wind; only what changes with the velocity is drag.

    Attributes:
        configured: linear drag per mass, 1/s.
    """

    def __init__(self, configured: float) -> None:
        self.configured = configured
        self._most = configured + _LARGEST
        self._weight = 0.0
        self._speed: list[float] = [0.0, 0.0]
        self._left: list[float] = [0.0, 0.0]
        self._squares = self._products = 0.0

    @property
    def drag(self) -> float:
        """What is known by now, 1/s."""
        squares, products = self._centred()
        found = (_PRIOR * self.configured - products) / (_PRIOR + squares)
        return min(max(found, 0.0), self._most)

    @property
    def certain(self) -> bool:
        """Whether the vehicle has moved about enough to tell."""
        return self._centred()[0] > _TOLD

    def _centred(self) -> tuple[float, float]:
        """Σ(v − v̄)² and Σ(v − v̄)·left, of both axes."""
        squares, products = self._squares, self._products
        if self._weight > 0.0:
            for speed, left in zip(self._speed, self._left, strict=True):
                squares -= speed * speed / self._weight
                products -= speed * left / self._weight
        return squares, products

    def observe(self, dt: float, velocity: Horizontal, left: Horizontal) -> None:
        """Take what the thrust does not explain.

        Args:
            dt: over which it was measured, s.
            velocity: meanwhile, m/s.
            left: acceleration that was measured, less that by thrust, m/s².
        """
        kept = exp(-dt / _MEMORY)
        self._weight = kept * self._weight + 1.0
        self._squares *= kept
        self._products *= kept
        for axis in (0, 1):
            self._speed[axis] = kept * self._speed[axis] + velocity[axis]
            self._left[axis] = kept * self._left[axis] + left[axis]
            self._squares += velocity[axis] * velocity[axis]
            self._products += velocity[axis] * left[axis]
