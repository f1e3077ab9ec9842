"""Heartbeats and TIMESYNC requests that the link sends, and why no heartbeat came.

Sources: the MAVLink heartbeat and time synchronisation protocols.
"""

import asyncio
from collections import deque
from collections.abc import Callable

from companion.mavlink.messages import Message, dialect
from companion.mavlink.outbox import Outbox
from companion.mavlink.router import Router
from companion.mavlink.settings import LinkSettings
from companion.mavlink.stats import LinkStats
from companion.vehicle.clock import VehicleClock
from companion.vehicle.clock_estimates import EXCHANGE_LIFETIME
from companion.vehicle.uplink import Uplink, UplinkProbes

_MAV_AUTOPILOT_INVALID = 8
_MAV_STATE_ACTIVE = 4
_MAVLINK_VERSION = 3
# For a good clock offset within the first second.
_QUICK_REQUESTS, _QUICK_REQUEST_PERIOD_S = 10, 0.1
_REQUEST_PERIOD_S = 1.0
_KEPT_REQUESTS = 16
_S_PER_NS = 1e-9


def send_heartbeat(settings: LinkSettings, outbox: Outbox) -> None:
    """Send one HEARTBEAT of the configured type, with the state active."""
    outbox.send(
        dialect.MAVLink_heartbeat_message(
            type=settings.heartbeat_type,
            autopilot=_MAV_AUTOPILOT_INVALID,
            base_mode=0,
            custom_mode=0,
            system_status=_MAV_STATE_ACTIVE,
            mavlink_version=_MAVLINK_VERSION,
        )
    )


async def send_heartbeats(settings: LinkSettings, outbox: Outbox) -> None:
    """Send heartbeats until cancelled. No setpoint depends on them."""
    while True:
        send_heartbeat(settings, outbox)
        await asyncio.sleep(1.0 / settings.heartbeat_rate_hz)


class TimeSync:
    """Sends TIMESYNC requests, gives the answers to `VehicleClock`, and answers the vehicle's own.

    Args:
        outbox: Sends requests and answers.
        router: Delivers TIMESYNC.
        clock: Returns the event-loop time, s.
        vehicle_clock: Takes each exchange of request and answer.
    """

    def __init__(
        self,
        outbox: Outbox,
        router: Router,
        clock: Callable[[], float],
        vehicle_clock: VehicleClock,
    ) -> None:
        self._outbox, self._clock, self._vehicle_clock = outbox, clock, vehicle_clock
        self._requests: deque[int] = deque(maxlen=_KEPT_REQUESTS)
        # (event-loop time of the answer, round trip), s
        self._round_trips: deque[tuple[float, float]] = deque(maxlen=_KEPT_REQUESTS)
        self._probes = UplinkProbes()
        router.subscribe("TIMESYNC", self._on_timesync)

    @property
    def round_trip_s(self) -> float | None:
        """The shortest recent round trip, s; `None` if no recent request was answered."""
        return min(self._recent_round_trips(), default=None)

    @property
    def jitter_s(self) -> float | None:
        """Range of the recent round trips, s; `None` if no recent request was answered."""
        trips = self._recent_round_trips()
        return max(trips) - min(trips) if trips else None

    @property
    def uplink(self) -> Uplink:
        """Present delay and loss on the link to the vehicle, measured by probes.

        If the link becomes slow, `Uplink.round_trip` shows it within a second, `round_trip_s` only
        after 16 s.
        """
        return self._probes.uplink(self._now_ns())

    def ask(self) -> None:
        """Send one TIMESYNC request."""
        stamp = self._now_ns()
        self._requests.append(stamp)
        self._send_request(stamp)

    def probe(self) -> None:
        """Send a probe (`UplinkProbes`), if one is due."""
        stamp = self._now_ns()
        if self._probes.due(stamp):
            self._probes.note_sent(stamp)
            self._send_request(stamp)

    def _send_request(self, stamp: int) -> None:
        self._outbox.send(dialect.MAVLink_timesync_message(tc1=0, ts1=stamp))

    def reset(self) -> None:
        """Forget all requests and answers, after a reconnect: the vehicle may have restarted."""
        self._requests.clear()
        self._round_trips.clear()
        self._probes = UplinkProbes()

    def _on_timesync(self, message: Message) -> None:
        now = self._now_ns()
        if message.tc1 == 0:
            self._outbox.send(dialect.MAVLink_timesync_message(tc1=now, ts1=message.ts1))
            return
        if message.ts1 in self._requests:
            self._requests.remove(message.ts1)
            self._round_trips.append((now * _S_PER_NS, (now - message.ts1) * _S_PER_NS))
            self._vehicle_clock.take_timesync(message.ts1 * _S_PER_NS, now * _S_PER_NS, message.tc1)
        elif message.ts1 not in self._probes:  # it answers another station
            return
        self._probes.take_answer(message.ts1, now)

    def _recent_round_trips(self) -> list[float]:
        oldest = self._clock() - EXCHANGE_LIFETIME
        return [round_trip for received, round_trip in self._round_trips if received >= oldest]

    def _now_ns(self) -> int:
        # Never 0: a zero in tc1 marks a request.
        return max(1, round(self._clock() * 1e9))


async def synchronise(timesync: TimeSync, clock: VehicleClock) -> None:
    """Send TIMESYNC requests until cancelled: quickly at first, then one each second."""
    now = asyncio.get_running_loop().time
    for _ in range(_QUICK_REQUESTS):
        timesync.ask()
        await asyncio.sleep(_QUICK_REQUEST_PERIOD_S)
    while True:
        timesync.ask()
        await asyncio.sleep(_REQUEST_PERIOD_S)
        clock.update(now())


def no_heartbeat_message(settings: LinkSettings, stats: LinkStats, timeout_s: float) -> str:
    """The error message if no heartbeat of the autopilot came within `timeout_s`."""
    opening = f"no heartbeat from system {settings.target_system} within {timeout_s:g} s"
    refused = _refusal_message(opening, stats)
    if refused is not None:
        return refused
    if stats.bad_crc:
        return (
            f"{opening}, but {stats.bad_crc} damaged frames; is the baud rate right? "
            "(link.endpoint)"
        )
    if settings.endpoint.startswith("serial:"):
        return (
            f"{opening} on {settings.endpoint}; is the vehicle running, does its port send "
            "MAVLink at this baud rate, and are TX and RX crossed?"
        )
    return f"{opening} on {settings.endpoint}; is the vehicle running and sending to this address?"


def no_beacon_message(settings: LinkSettings, stats: LinkStats) -> str:
    """The error message if no lockstep beacon came within `first_beacon_timeout_s`."""
    opening = f"no lockstep beacon within {settings.first_beacon_timeout_s:g} s"
    why = f"{opening} on {settings.endpoint}; is the vehicle running, and in lockstep?"
    return _refusal_message(opening, stats) or why


def _refusal_message(opening: str, stats: LinkStats) -> str | None:
    """The error message if frames were refused for their sender or signature; otherwise None.

    Args:
        opening: first clause of the message.
        stats: counters of the link.
    """
    if stats.unclaimed:
        return (
            f"{opening}, but {stats.unclaimed} other frames with the vehicle's ids; let the "
            "autopilot send HEARTBEAT on this link, because only its sender counts as the vehicle"
        )
    if stats.ignored_foreign:
        source = "/".join(map(str, min(stats.foreign_sources)))
        return (
            f"{opening}, but {stats.ignored_foreign} frames from others, such as system/component "
            f"{source}; is link.target_system right?"
        )
    if stats.bad_signature:
        return (
            f"{opening}, but {stats.bad_signature} frames that are not signed with the key in "
            "link.signing_key_file, or whose time stamp is refused; give both sides the same key, "
            "and set this computer's clock"
        )
    return None
