"""Link faults: drops, delays, duplicates, reorders and corrupts datagrams (no I/O)."""

import heapq
import random
from itertools import count

from sitl_mock.config.faults import LinkFault


class DatagramPipe:
    """Applies link faults to the datagrams of one direction of the companion link.

    Args:
        direction: ``to_companion`` or ``from_companion``.
        seed: seed of the random numbers of this direction.
    """

    def __init__(self, direction: str, seed: int) -> None:
        self._direction = direction
        self._random = random.Random(seed)
        self._delayed_datagrams: list[tuple[float, int, bytes]] = []
        self._delayed_count = count()
        self._held_back_datagram: bytes | None = None

    def passes_unchanged(self, faults: tuple[LinkFault, ...]) -> bool:
        """Whether no fault is active and no datagram is held back."""
        return not faults and not self._delayed_datagrams and self._held_back_datagram is None

    def push(
        self, datagrams: list[bytes], faults: tuple[LinkFault, ...], now_us: int
    ) -> list[bytes]:
        """Accept datagrams; return those to deliver now, delayed ones first."""
        active_faults = [fault for fault in faults if fault.direction in (self._direction, "both")]
        to_deliver = []
        while self._delayed_datagrams and self._delayed_datagrams[0][0] <= now_us:
            to_deliver.append(heapq.heappop(self._delayed_datagrams)[2])
        for datagram in datagrams:
            survivors = [datagram]
            for fault in active_faults:
                survivors = [
                    passed_datagram
                    for survivor in survivors
                    for passed_datagram in self._apply(survivor, fault, now_us)
                ]
            if survivors and self._held_back_datagram is not None:
                survivors.append(self._held_back_datagram)
                self._held_back_datagram = None
            to_deliver.extend(survivors)
        return to_deliver

    def _apply(self, datagram: bytes, fault: LinkFault, now_us: int) -> list[bytes]:
        """Apply one fault to one datagram; return the datagrams to deliver now."""
        if self._random.random() >= fault.probability:
            return [datagram]
        match fault.kind:
            case "duplicate":
                return [datagram, datagram]
            case "corrupt":
                return [self._corrupted(datagram)]
            case "delay":
                due_us = now_us + fault.delay_ms * 1e3
                heapq.heappush(
                    self._delayed_datagrams, (due_us, next(self._delayed_count), datagram)
                )
            case "reorder" if self._held_back_datagram is None:
                self._held_back_datagram = datagram
            case "reorder":
                return [datagram]
            case "drop":
                pass
        return []

    def _corrupted(self, datagram: bytes) -> bytes:
        if not datagram:
            return datagram
        corrupted = bytearray(datagram)
        corrupted[self._random.randrange(len(corrupted))] ^= self._random.randrange(1, 256)
        return bytes(corrupted)
