"""TIMESYNC: compares the clocks, and measures delay and loss on the link to the vehicle.

Source: the MAVLink time synchronisation protocol. An exchange is a request whose answer enters the
estimate of the vehicle's clock. A probe is a request whose answer only measures the link to the
vehicle, over which setpoints are sent. Setpoints are not acknowledged, so only the answers to
probes show that setpoints come late or are lost.
"""

import asyncio
from collections import deque
from collections.abc import Callable
from math import inf
from typing import NamedTuple

from companion.mavlink.dispatcher import MessageDispatcher
from companion.mavlink.messages import Message, dialect
from companion.mavlink.outbox import Outbox
from companion.vehicle.clock import VehicleClock
from companion.vehicle.clock_estimates import EXCHANGE_LIFETIME
from companion.vehicle.clock_jumps import RESTART_SETBACK, describe_change

# The first exchanges follow quickly, so that the clock offset is good after a second.
_QUICK_EXCHANGES, _QUICK_EXCHANGE_PERIOD_S = 10, 0.1
_EXCHANGE_PERIOD_S = 1.0
_JUST_BOOTED = 60.0
"""Longest time since boot of a vehicle that has just restarted, s; no other clock shows so little.
"""
_STALLED_PERIOD_S = 1.5
"""A longer period, s, is a stall of this program; so long after it, missing answers say nothing."""
_NS_PER_S, _S_PER_NS = 1e9, 1e-9
_PROBE_PERIOD_NS = 0.1 * _NS_PER_S
_UPLINK_WINDOW_NS = 0.7 * _NS_PER_S
"""Window of `Uplink.round_trip`, ns: it uses only probes answered in the last 0.7 s. A link that
becomes slow is noticed after about this time: until then, earlier answers still count."""
_MIN_PROBES = 6
"""Smallest number of probes sent in `_UPLINK_WINDOW_NS` to judge the link: with fewer, probing has
just begun."""
_MAX_KEPT_REQUESTS = 16
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
        self._unanswered_ns: deque[int] = deque(maxlen=_MAX_KEPT_REQUESTS)
        # (arrival of the answer, round trip)
        self._round_trips_ns: deque[tuple[int, int]] = deque(maxlen=_MAX_KEPT_REQUESTS)

    def add_sent(self, sent_ns: int) -> None:
        """Remember the request sent at `sent_ns`; its answer will contain this time."""
        self._unanswered_ns.append(sent_ns)

    def take_answer(self, sent_ns: int, now_ns: int) -> bool:
        """Take the answer to the request sent at `sent_ns`; False if no such request is waiting."""
        if sent_ns not in self._unanswered_ns:
            return False
        self._unanswered_ns.remove(sent_ns)
        self._round_trips_ns.append((now_ns, now_ns - sent_ns))
        return True

    def unanswered_count(self, since_ns: int) -> int:
        """Number of unanswered requests sent after `since_ns`."""
        return sum(sent_ns > since_ns for sent_ns in self._unanswered_ns)

    def sent_count(self, since_ns: float) -> int:
        """Number of requests sent at `since_ns` or later."""
        answered_count = sum(
            answered_ns - round_trip_ns >= since_ns
            for answered_ns, round_trip_ns in self._round_trips_ns
        )
        return answered_count + sum(sent_ns >= since_ns for sent_ns in self._unanswered_ns)

    def round_trips(self, since_ns: float) -> list[float]:
        """The round trips that ended at `since_ns` or later, s."""
        return [
            _S_PER_NS * round_trip_ns
            for answered_ns, round_trip_ns in self._round_trips_ns
            if answered_ns >= since_ns
        ]


class TimeSync:
    """Sends TIMESYNC requests, gives the answers to `VehicleClock`, and answers the vehicle's own.

    Args:
        clock: returns the event-loop time, s.
        vehicle_clock: takes each exchange of request and answer.

    Attributes:
        restart_count: counts answers whose time went back to that of a vehicle which just booted.
        last_restart: the newest of these restarts in words; empty before the first.
    """

    def __init__(
        self,
        outbox: Outbox,
        dispatcher: MessageDispatcher,
        clock: Callable[[], float],
        vehicle_clock: VehicleClock,
    ) -> None:
        self._outbox, self._clock, self._vehicle_clock = outbox, clock, vehicle_clock
        self.restart_count, self.last_restart, self._vehicle_time = 0, "", -inf
        self.reset()
        dispatcher.subscribe("TIMESYNC", self._on_timesync)

    def reset(self) -> None:
        """Forget all requests and answers, after a reconnect: the vehicle may have restarted."""
        self._exchanges, self._probes = _Requests(), _Requests()
        self._newest_answered_ns: int | None = None
        self._probe_due_ns = 0.0

    async def run(self) -> None:
        """Begin exchanges until cancelled: quickly at first, then one each second."""
        for _ in range(_QUICK_EXCHANGES):
            self.send_exchange_request()
            await asyncio.sleep(_QUICK_EXCHANGE_PERIOD_S)
        stalled_at = -inf
        while True:
            self.send_exchange_request()
            sent = self._clock()
            await asyncio.sleep(_EXCHANGE_PERIOD_S)
            now = self._clock()
            if now - sent > _STALLED_PERIOD_S:
                stalled_at = now
            if now - stalled_at > _STALLED_PERIOD_S:
                self._vehicle_clock.update(now)

    def send_exchange_request(self) -> None:
        """Send the request of one exchange."""
        self._send_request(self._exchanges, self._now_ns())

    def probe(self) -> None:
        """Send a probe, if one is due; at most ten are sent in a second."""
        now_ns = self._now_ns()
        if now_ns >= self._probe_due_ns:
            self._probe_due_ns = now_ns + _PROBE_PERIOD_NS
            self._send_request(self._probes, now_ns)

    @property
    def round_trip_s(self) -> float | None:
        """The shortest recent round trip of the exchanges, s; `None` if none was answered."""
        return min(self._recent_round_trips(), default=None)

    @property
    def jitter_s(self) -> float | None:
        """Largest minus smallest recent round trip of the exchanges, s; `None`: none answered."""
        round_trips = self._recent_round_trips()
        return max(round_trips) - min(round_trips) if round_trips else None

    @property
    def uplink(self) -> Uplink:
        """Present delay and loss on the link to the vehicle, measured by probes.

        If the link becomes slow, `Uplink.round_trip` shows it within a second, `round_trip_s` only
        after 16 s.
        """
        since_ns = self._now_ns() - _UPLINK_WINDOW_NS
        enough_probes = self._probes.sent_count(since_ns) >= _MIN_PROBES
        newest_answered_ns = self._newest_answered_ns
        return Uplink(
            min(self._probes.round_trips(since_ns), default=None) if enough_probes else None,
            None
            if newest_answered_ns is None
            else self._probes.unanswered_count(newest_answered_ns),
        )

    def _send_request(self, requests: _Requests, sent_ns: int) -> None:
        requests.add_sent(sent_ns)
        self._outbox.send(dialect.MAVLink_timesync_message(tc1=0, ts1=sent_ns))

    def _on_timesync(self, message: Message) -> None:
        now_ns, sent_ns = self._now_ns(), message.ts1
        if message.tc1 == 0:
            self._outbox.send(dialect.MAVLink_timesync_message(tc1=now_ns, ts1=sent_ns))
            return
        if self._exchanges.take_answer(sent_ns, now_ns):
            self._vehicle_clock.take_timesync(sent_ns * _S_PER_NS, now_ns * _S_PER_NS, message.tc1)
        elif not self._probes.take_answer(sent_ns, now_ns):  # it answers another station
            return
        self._newest_answered_ns = max(sent_ns, self._newest_answered_ns or 0)
        self._notice_restart(message.tc1 * _S_PER_NS)

    def _notice_restart(self, vehicle_time: float) -> None:
        before, self._vehicle_time = self._vehicle_time, vehicle_time
        if vehicle_time < min(before - RESTART_SETBACK, _JUST_BOOTED):
            self.restart_count += 1
            setback = vehicle_time - before
            self.last_restart = describe_change(setback, before, vehicle_time, set_back=True)

    def _recent_round_trips(self) -> list[float]:
        return self._exchanges.round_trips(since_ns=self._now_ns() - EXCHANGE_LIFETIME * _NS_PER_S)

    def _now_ns(self) -> int:
        # Never 0: a zero in tc1 marks a request.
        return max(1, round(self._clock() * _NS_PER_S))
