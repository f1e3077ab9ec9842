"""TIMESYNC: compares the clocks, and measures delay and loss on the link to the vehicle.

Source: the MAVLink time synchronisation protocol. An exchange is a request whose answer enters the
estimate of the vehicle's clock. A probe is a request whose answer only measures the link to the
vehicle, over which setpoints are sent. Setpoints are not acknowledged, so only the answers to
probes show that setpoints come late or are lost.
"""

import asyncio
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from companion.mavlink.dispatcher import MessageDispatcher
from companion.mavlink.messages import Message, dialect
from companion.mavlink.outbox import Outbox
from companion.vehicle.clock import VehicleClock
from companion.vehicle.clock_estimates import EXCHANGE_LIFETIME

# The first exchanges follow quickly, so that the clock offset is good after a second.
_QUICK_EXCHANGES, _QUICK_EXCHANGE_PERIOD_S = 10, 0.1
_EXCHANGE_PERIOD_S = 1.0
_NS_PER_S, _S_PER_NS = 1e9, 1e-9
_PROBE_PERIOD = 0.1 * _NS_PER_S
_UPLINK_WINDOW = 0.7 * _NS_PER_S
"""Window of `Uplink.round_trip`, ns: it uses only probes answered in the last 0.7 s. A link that
becomes slow is noticed after about this time: until then, earlier answers still count."""
_MIN_PROBES = 6
"""Smallest number of probes sent in `_UPLINK_WINDOW` to judge the link: with fewer, probing has
just begun."""
_KEPT_REQUESTS = 16
"""Number of unanswered requests, and of round trips, that are kept for each kind of request."""


class Uplink(NamedTuple):
    """Present delay and loss on the link to the vehicle."""

    round_trip: float | None = None
    """Shortest round trip of the probes answered in the last 0.7 s, s; None: no probe was
    answered, or fewer than six were sent."""
    unanswered_count: int | None = None
    """Number of probes sent since the newest request that was answered, at most 16; None: the
    vehicle has not answered any TIMESYNC request."""


class _Requests:
    """Our requests of one kind: the unanswered ones, and the latest round trips of answered ones.

    All times are event-loop times, ns.
    """

    def __init__(self) -> None:
        self._unanswered: deque[int] = deque(maxlen=_KEPT_REQUESTS)
        # (arrival of the answer, round trip)
        self._round_trips: deque[tuple[int, int]] = deque(maxlen=_KEPT_REQUESTS)

    def note_sent(self, stamp: int) -> None:
        """Remember the request sent at `stamp`; its answer will contain this time."""
        self._unanswered.append(stamp)

    def take_answer(self, stamp: int, now: int) -> bool:
        """Take the answer to the request sent at `stamp`; False if no such request is waiting."""
        if stamp not in self._unanswered:
            return False
        self._unanswered.remove(stamp)
        self._round_trips.append((now, now - stamp))
        return True

    def unanswered_count(self, since: int) -> int:
        """Number of unanswered requests sent after `since`."""
        return sum(sent > since for sent in self._unanswered)

    def sent_count(self, since: float) -> int:
        """Number of requests sent at `since` or later."""
        answered = sum(ended - trip >= since for ended, trip in self._round_trips)
        return answered + sum(stamp >= since for stamp in self._unanswered)

    def round_trips(self, since: float) -> list[float]:
        """The round trips that ended at `since` or later, s."""
        return [_S_PER_NS * trip for ended, trip in self._round_trips if ended >= since]


class TimeSync:
    """Sends TIMESYNC requests, gives the answers to `VehicleClock`, and answers the vehicle's own.

    Args:
        clock: returns the event-loop time, s.
        vehicle_clock: takes each exchange of request and answer.
    """

    def __init__(
        self,
        outbox: Outbox,
        dispatcher: MessageDispatcher,
        clock: Callable[[], float],
        vehicle_clock: VehicleClock,
    ) -> None:
        self._outbox, self._clock, self._vehicle_clock = outbox, clock, vehicle_clock
        self.reset()
        dispatcher.subscribe("TIMESYNC", self._on_timesync)

    def reset(self) -> None:
        """Forget all requests and answers, after a reconnect: the vehicle may have restarted."""
        self._exchanges, self._probes = _Requests(), _Requests()
        self._newest_answered: int | None = None
        self._probe_due = 0.0

    async def run(self) -> None:
        """Begin exchanges until cancelled: quickly at first, then one each second."""
        for _ in range(_QUICK_EXCHANGES):
            self.send_exchange_request()
            await asyncio.sleep(_QUICK_EXCHANGE_PERIOD_S)
        while True:
            self.send_exchange_request()
            await asyncio.sleep(_EXCHANGE_PERIOD_S)
            self._vehicle_clock.update(self._clock())

    def send_exchange_request(self) -> None:
        """Send the request of one exchange."""
        self._send_request(self._exchanges, self._now_ns())

    def probe(self) -> None:
        """Send a probe, if one is due; at most ten are sent in a second."""
        now = self._now_ns()
        if now >= self._probe_due:
            self._probe_due = now + _PROBE_PERIOD
            self._send_request(self._probes, now)

    @property
    def round_trip_s(self) -> float | None:
        """The shortest recent round trip of the exchanges, s; `None` if none was answered."""
        return min(self._recent_round_trips(), default=None)

    @property
    def jitter_s(self) -> float | None:
        """Range of the recent round trips of the exchanges, s; `None` if none was answered."""
        trips = self._recent_round_trips()
        return max(trips) - min(trips) if trips else None

    @property
    def uplink(self) -> Uplink:
        """Present delay and loss on the link to the vehicle, measured by probes.

        If the link becomes slow, `Uplink.round_trip` shows it within a second, `round_trip_s` only
        after 16 s.
        """
        since = self._now_ns() - _UPLINK_WINDOW
        enough_probes = self._probes.sent_count(since) >= _MIN_PROBES
        newest_answered = self._newest_answered
        return Uplink(
            min(self._probes.round_trips(since), default=None) if enough_probes else None,
            None if newest_answered is None else self._probes.unanswered_count(newest_answered),
        )

    def _send_request(self, requests: _Requests, stamp: int) -> None:
        requests.note_sent(stamp)
        self._outbox.send(dialect.MAVLink_timesync_message(tc1=0, ts1=stamp))

    def _on_timesync(self, message: Message) -> None:
        now, stamp = self._now_ns(), message.ts1
        if message.tc1 == 0:
            self._outbox.send(dialect.MAVLink_timesync_message(tc1=now, ts1=stamp))
            return
        if self._exchanges.take_answer(stamp, now):
            self._vehicle_clock.take_timesync(stamp * _S_PER_NS, now * _S_PER_NS, message.tc1)
        elif not self._probes.take_answer(stamp, now):  # it answers another station
            return
        self._newest_answered = max(stamp, self._newest_answered or 0)

    def _recent_round_trips(self) -> list[float]:
        return self._exchanges.round_trips(since=self._now_ns() - EXCHANGE_LIFETIME * _NS_PER_S)

    def _now_ns(self) -> int:
        # Never 0: a zero in tc1 marks a request.
        return max(1, round(self._clock() * _NS_PER_S))
