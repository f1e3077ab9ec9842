"""TIMESYNC: how the vehicle's clock stands to ours. Source: the MAVLink time synchronisation."""

from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from pymavlink.dialects.v20 import ardupilotmega as dialect

from companion.mavlink.codec import Message
from companion.mavlink.outbox import Outbox
from companion.mavlink.router import Router

_WINDOW = 16  # exchanges; the quickest of them had the least queueing, so it is believed
_NS = 1e-9


class _Exchange(NamedTuple):
    round_trip_s: float
    offset_s: float


class TimeSync:
    """Estimates the offset of the two clocks, and answers the vehicle's own requests.

    Args:
        clock: Our time in s (the event loop's).
    """

    def __init__(self, outbox: Outbox, router: Router, clock: Callable[[], float]) -> None:
        self._outbox, self._clock = outbox, clock
        self._asked: deque[int] = deque(maxlen=_WINDOW)
        self._exchanges: deque[_Exchange] = deque(maxlen=_WINDOW)
        router.subscribe("TIMESYNC", self._on_timesync)

    @property
    def offset_s(self) -> float | None:
        """Vehicle time minus ours, s; `None` before the first answer."""
        return min(self._exchanges).offset_s if self._exchanges else None

    @property
    def round_trip_s(self) -> float | None:
        """The shortest round trip of late, s; it bounds the offset's error to half of it."""
        return min(self._exchanges).round_trip_s if self._exchanges else None

    def sample_age(self, time_boot_ms: int) -> float | None:
        """How long ago the vehicle stamped `time_boot_ms`, s; `None` before the first answer."""
        offset = self.offset_s
        return None if offset is None else self._clock() + offset - time_boot_ms / 1000.0

    def ask(self) -> None:
        """Send one request."""
        stamp = self._now_ns()
        self._asked.append(stamp)
        self._outbox.message(dialect.MAVLink_timesync_message(tc1=0, ts1=stamp))

    def reset(self) -> None:
        """Forget all, after a reconnect: the vehicle may have started anew."""
        self._asked.clear()
        self._exchanges.clear()

    def _on_timesync(self, message: Message) -> None:
        now = self._now_ns()
        if message.tc1 == 0:
            self._outbox.message(dialect.MAVLink_timesync_message(tc1=now, ts1=message.ts1))
        elif message.ts1 in self._asked:  # anything else answers another station
            self._asked.remove(message.ts1)
            offset_ns = message.tc1 - (message.ts1 + now) // 2
            self._exchanges.append(_Exchange((now - message.ts1) * _NS, offset_ns * _NS))

    def _now_ns(self) -> int:
        # Never 0: a zero in tc1 marks a request.
        return max(1, round(self._clock() * 1e9))
