"""Moves the values of the loops from one configuration to another in small steps."""

from companion.config import Config
from companion.control.retuning import Tuning, interpolated, tuning

SLEW_TIME = 0.7
"""Time over which a change takes effect, s."""
_SHORTEST_STEP = 0.035
"""Shortest time between two steps of a change, s: each step computes the gains again."""


class Slew:
    """Interpolates from the present configuration to the wanted one; times are in s on one clock.

    Attributes:
        settled: the newest configuration that was fully in effect.

    Args:
        config: the present configuration, which is also the wanted one at first.
    """

    def __init__(self, config: Config) -> None:
        self._present = self._start = self._wanted = self.settled = config
        self._began_at: float | None = None
        self._stepped_at = 0.0

    def jump(self, wanted: Config) -> None:
        """Take the wanted values at once, because no loop flies yet or any more."""
        self._present = self._wanted = self.settled = wanted
        self._began_at = None

    def begin(self, wanted: Config, now: float) -> None:
        """Begin to move from the present values to the wanted ones."""
        self._start, self._wanted, self._began_at = self._present, wanted, now

    def stop(self) -> None:
        """Stay at the present values."""
        self._began_at = None

    def step(self, now: float) -> Tuning | None:
        """The values to use from now on; None: no change.

        Raises:
            ValueError: gains cannot be computed from the new values.
        """
        if self._began_at is None or now - self._stepped_at < _SHORTEST_STEP:
            return None
        self._stepped_at = now
        share = (now - self._began_at) / SLEW_TIME
        self._present = interpolated(self._start, self._wanted, share)
        values = tuning(self._present)
        if share >= 1.0:
            self._began_at, self.settled = None, self._wanted
        return values
