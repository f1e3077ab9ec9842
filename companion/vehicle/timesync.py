"""TIMESYNC: asking what the vehicle's clock says. Source: the MAVLink time synchronisation."""

from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from companion.mavlink.messages import Message, dialect
from companion.mavlink.outbox import Outbox
from companion.mavlink.router import Router
from companion.vehicle.clock import VehicleClock
from companion.vehicle.telemetry_delay import LIFETIME

_WINDOW = 16
_NS = 1e-9


class _Exchange(NamedTuple):
    round_trip_s: float
    at: float


class TimeSync:
    """Asks for the vehicle's time for `VehicleClock`, and answers the vehicle's own requests.

    Args:
        outbox: Takes what is sent.
        router: Brings TIMESYNC.
        clock: Our time in s (the event loop's).
        vehicle_clock: Takes each exchange.
    """

    def __init__(
        self,
        outbox: Outbox,
        router: Router,
        clock: Callable[[], float],
        vehicle_clock: VehicleClock,
    ) -> None:
        self._outbox, self._clock, self._vehicle_clock = outbox, clock, vehicle_clock
        self._asked: deque[int] = deque(maxlen=_WINDOW)
        self._exchanges: deque[_Exchange] = deque(maxlen=_WINDOW)
        router.subscribe("TIMESYNC", self._on_timesync)

    @property
    def round_trip_s(self) -> float | None:
        """The shortest round trip of late, s; `None` where none was answered of late."""
        return min(self._round_trips(), default=None)

    @property
    def jitter_s(self) -> float | None:
        """By how much the round trips of late differ, s; `None` where none was answered."""
        trips = self._round_trips()
        return max(trips) - min(trips) if trips else None

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
            self._exchanges.append(_Exchange((now - message.ts1) * _NS, now * _NS))
            self._vehicle_clock.exchange(message.ts1 * _NS, now * _NS, message.tc1)

    def _round_trips(self) -> list[float]:
        oldest = self._clock() - LIFETIME
        return [each.round_trip_s for each in self._exchanges if each.at >= oldest]

    def _now_ns(self) -> int:
        # Never 0: a zero in tc1 marks a request.
        return max(1, round(self._clock() * 1e9))
