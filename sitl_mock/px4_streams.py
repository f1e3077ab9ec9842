"""When PX4 sends each telemetry message of a link: intervals asked, slots served.

A stream is served in *slots*, the turns of the autopilot's MAVLink loop. With a 250 Hz inner loop a
slot comes every 4 ms, with 800 Hz every 2.5 ms. What arrives therefore differs from what was asked;
the rules below reproduce the rates measured on PX4 (asked 100/200/250/400/500/1000 Hz gave
99/124/197/191/189/199 with the 250 Hz loop, 98/196/196/392/392/392 with 800 Hz).
"""

from collections.abc import Mapping

SLOT_US = {250: 4000, 800: 2500}
"""Slot period in us of vehicle time by inner loop rate in Hz."""

HEARTBEAT, CURRENT_MODE = 0, 436

BUSY_RUN = 4
"""A stream sent in this many slots running misses the next one (250 Hz loop only, measured)."""


class _Stream:
    __slots__ = ("interval_us", "last_us", "run", "status_us")

    def __init__(self, interval_us: int, last_us: int) -> None:
        self.interval_us = interval_us
        self.last_us = last_us
        self.run = 0
        self.status_us = -1


class Px4Streams:
    """The streams of one link, as PX4 serves them.

    Args:
        rates: message id -> Hz, the rates at boot.
        misses: whether a stream at the full slot rate misses every fifth slot.
    """

    def __init__(self, rates: Mapping[int, float], *, misses: bool) -> None:
        self._defaults = {message: round(1e6 / hz) for message, hz in rates.items()}
        self._misses = misses
        self._streams = {
            message: _Stream(interval, -interval) for message, interval in self._defaults.items()
        }

    def set_interval(self, message_id: int, interval_us: float, now_us: int) -> str | None:
        """Ask for a message every ``interval_us``; 0 = the rate at boot, negative = never.

        Returns:
            why it is refused, None if it is not; PX4 refuses nothing but to change HEARTBEAT.
        """
        if message_id == HEARTBEAT:
            return "the rate of HEARTBEAT is fixed"
        interval = round(interval_us)
        if interval == 0:
            interval = self._defaults.get(message_id, -1)
        if interval < 0:
            self._streams.pop(message_id, None)
        else:
            self._streams[message_id] = _Stream(interval, now_us)
        return None

    def interval(self, message_id: int) -> int:
        """Return the interval in us that is set for a message, -1 if it is not streamed."""
        stream = self._streams.get(message_id)
        return -1 if stream is None else stream.interval_us

    def due(self, slot_us: int, status_us: int = 0) -> list[int]:
        """Return the ids of the messages to send in the slot at ``slot_us``; they count as sent.

        CURRENT_MODE is sent once for each publication of the vehicle's status, the newest of which
        came at ``status_us``, however often the message is asked for (measured: 2 Hz of 20 asked).
        """
        due = []
        for message_id, stream in self._streams.items():
            waited = slot_us - stream.last_us
            nothing_new = message_id == CURRENT_MODE and stream.status_us == status_us
            if waited < stream.interval_us or nothing_new:
                stream.run = 0
                continue
            if self._misses and stream.run >= BUSY_RUN:
                stream.run = 0
                continue
            # Keep the phase while it is nearly met; start a new one when the slots are too coarse.
            on_time = 2 * waited < 3 * stream.interval_us
            stream.last_us = stream.last_us + stream.interval_us if on_time else slot_us
            stream.run += 1
            stream.status_us = status_us
            due.append(message_id)
        return due
