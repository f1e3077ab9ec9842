"""A bad link: datagrams in, datagrams out, some lost, late, doubled, swapped or damaged (pure)."""

import heapq
import random
from itertools import count

from sitl_mock.config.faults import LinkFault


class DatagramPipe:
    """One direction of a link.

    Args:
        direction: ``to_companion`` or ``from_companion``.
        seed: of this direction's luck.
    """

    def __init__(self, direction: str, seed: int) -> None:
        self._direction = direction
        self._random = random.Random(seed)
        self._late: list[tuple[float, int, bytes]] = []
        self._order = count()
        self._held: bytes | None = None

    def is_clear(self, faults: tuple[LinkFault, ...]) -> bool:
        """Whether datagrams pass untouched and none is still under way."""
        return not faults and not self._late and self._held is None

    def push(
        self, datagrams: list[bytes], faults: tuple[LinkFault, ...], now_us: int
    ) -> list[bytes]:
        """Send datagrams in, and return those that come out now, late ones that are due first."""
        mine = [fault for fault in faults if fault.direction in (self._direction, "both")]
        out = [heapq.heappop(self._late)[2] for _ in range(self._due(now_us))]
        for datagram in datagrams:
            survivors = [datagram]
            for fault in mine:
                survivors = [out for one in survivors for out in self._strike(one, fault, now_us)]
            if survivors and self._held is not None:
                survivors.append(self._held)
                self._held = None
            out.extend(survivors)
        return out

    def _due(self, now_us: int) -> int:
        return sum(1 for due, _, _ in self._late if due <= now_us)

    def _strike(self, datagram: bytes, fault: LinkFault, now_us: int) -> list[bytes]:
        """Return what one fault leaves of one datagram."""
        if self._random.random() >= fault.probability:
            return [datagram]
        match fault.kind:
            case "duplicate":
                return [datagram, datagram]
            case "corrupt":
                return [self._damaged(datagram)]
            case "delay":
                due = now_us + fault.delay_ms * 1e3
                heapq.heappush(self._late, (due, next(self._order), datagram))
            case "reorder" if self._held is None:
                self._held = datagram
            case "reorder":
                return [datagram]
            case "drop":
                pass
        return []

    def _damaged(self, datagram: bytes) -> bytes:
        if not datagram:
            return datagram
        damaged = bytearray(datagram)
        damaged[self._random.randrange(len(damaged))] ^= self._random.randrange(1, 256)
        return bytes(damaged)
