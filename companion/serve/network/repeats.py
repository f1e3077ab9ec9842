"""Frames that come back: a client may return what it hears, directly or by way of another one."""

from collections.abc import Callable

_WITHIN = 0.2
"""A frame that is identical to one of the last so many s is a repetition, s."""
_MOST = 4096
"""Largest number of frames remembered; of a flood, only the newest are."""


class Repeats:
    """Finds frames that came before, on whatever channel.

    A frame's running number and checksum make it differ from its sender's next 255. A sender
    without running numbers is heard at most every 0.2 s with the same content.

    Args:
        clock: our clock, s.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._newer: set[bytes] = set()
        self._older: set[bytes] = set()
        self._since = clock()

    def is_repeat(self, raw: bytes) -> bool:
        """Whether these bytes came just before; remembers them."""
        age = self._clock() - self._since
        if age > _WITHIN or len(self._newer) >= _MOST // 2:
            self._older = set() if age > 2.0 * _WITHIN else self._newer
            self._newer, self._since = set(), self._since + age
        if raw in self._newer or raw in self._older:
            return True
        self._newer.add(raw)
        return False
