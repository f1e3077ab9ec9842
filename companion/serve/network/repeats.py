"""Detects frames that come back: a client may return frames directly or through another client."""

from collections import OrderedDict
from collections.abc import Callable

_WITHIN = 0.2
"""A frame identical to one that was forwarded within this time is a repetition, s."""
_MOST = 4096
"""Largest number of remembered frames; in a flood, only the newest are remembered."""


class Repeats:
    """Detects frames that have come before, on any channel.

    Sequence number and checksum distinguish a frame from its sender's next 255 frames. If a sender
    does not count its frames, the same content is forwarded once in 0.2 s.

    Args:
        clock: our clock, s.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._passed: OrderedDict[bytes, float] = OrderedDict()

    def is_repeat(self, raw: bytes) -> bool:
        """Whether these bytes were forwarded just before; if not, remember them."""
        now, passed = self._clock(), self._passed
        at = passed.pop(raw, None)
        if at is not None and now - at <= _WITHIN:
            passed[raw] = at
            return True
        passed[raw] = now
        while len(passed) > _MOST:
            passed.popitem(last=False)
        return False
