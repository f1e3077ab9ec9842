"""Frames that come back: a client may return what it hears, directly or by way of another one."""

from collections import OrderedDict
from collections.abc import Callable

_WITHIN = 0.2
"""A frame that is identical to one that was passed on less than this ago is a repetition, s."""
_MOST = 4096
"""Largest number of frames remembered; of a flood, only the newest are."""


class Repeats:
    """Finds frames that came before, on whatever channel.

    A frame's running number and checksum make it differ from its sender's next 255. Of a sender
    without running numbers, the same content is passed on once in 0.2 s.

    Args:
        clock: our clock, s.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._passed: OrderedDict[bytes, float] = OrderedDict()

    def is_repeat(self, raw: bytes) -> bool:
        """Whether these bytes were passed on just before; if not, remembers them."""
        now, passed = self._clock(), self._passed
        at = passed.pop(raw, None)
        if at is not None and now - at <= _WITHIN:
            passed[raw] = at
            return True
        passed[raw] = now
        while len(passed) > _MOST:
            passed.popitem(last=False)
        return False
