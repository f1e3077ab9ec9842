"""Moves the values of the loops from one configuration to another in small steps."""

from companion.config import Config
from companion.control.retuning import LoopSettings, interpolated_config, loop_settings

SLEW_TIME = 0.7
"""Time over which a change takes effect, s."""
_SHORTEST_STEP = 0.035
"""Shortest time between two steps of a change, s: each step computes the gains again."""


class Slew:
    """Interpolates from the present configuration to the wanted one; times are in s of one clock.

    Attributes:
        settled_config: the newest configuration that was completely in effect.

    Args:
        config: the present configuration, which is also the wanted one at first.
    """

    def __init__(self, config: Config) -> None:
        self._present_config = self._start_config = self._wanted_config = config
        self.settled_config = config
        self._began_at: float | None = None
        self._stepped_at = 0.0

    def jump(self, wanted: Config) -> None:
        """Take the wanted values at once, because control has not begun yet or has ended."""
        self._present_config = self._wanted_config = self.settled_config = wanted
        self._began_at = None

    def begin(self, wanted: Config, now: float) -> None:
        """Begin to move from the present values to the wanted ones."""
        self._start_config, self._wanted_config = self._present_config, wanted
        self._began_at = now

    def stop(self) -> None:
        """Stay at the present values."""
        self._began_at = None

    def step(self, now: float) -> LoopSettings | None:
        """The values to use from now on; None: no change.

        Raises:
            ValueError: gains cannot be computed from the new values.
        """
        if self._began_at is None or now - self._stepped_at < _SHORTEST_STEP:
            return None
        self._stepped_at = now
        share = (now - self._began_at) / SLEW_TIME
        self._present_config = interpolated_config(self._start_config, self._wanted_config, share)
        values = loop_settings(self._present_config)
        if share >= 1.0:
            self._began_at, self.settled_config = None, self._wanted_config
        return values
