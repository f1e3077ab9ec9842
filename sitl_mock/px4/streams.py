"""When PX4 sends each telemetry message of a link: intervals asked, slots served.

A stream is served in *slots*, the turns of the autopilot's MAVLink loop. With a 250 Hz inner loop a
slot comes every 4 ms, with 800 Hz every 2.5 ms. What arrives therefore differs from what was asked;
the rules below reproduce the rates measured on PX4 (asked 100/200/400/500/1000 Hz gave
99/124/191/189/199 with the 250 Hz loop, 98/196/392/392/392 with 800 Hz; asked 250 Hz gave 190 to
235, in steps of 4 and 8 ms; a position at 50 Hz comes in steps of 16 and 24 ms).
"""

from collections.abc import Mapping
from random import Random

SLOT_US = {250: 4000, 800: 2500}
"""Slot period in us of vehicle time by inner loop rate in Hz."""

HEARTBEAT, LOCAL_POSITION_NED, CURRENT_MODE = 0, 32, 436

BUSY_SHARE = 0.22
"""Where a stream was sent in the slot before, this is the probability that it misses the next one
(250 Hz loop only; measured: 0.17 in one flight, 0.23 in another)."""

NEW_EVERY_US = {LOCAL_POSITION_NED: 8000}
"""A new position comes this often, and none is sent twice."""


class _Stream:
    __slots__ = ("in_slot_before", "interval_us", "last_us", "status_us")

    def __init__(self, interval_us: int, last_us: int) -> None:
        self.interval_us = interval_us
        self.last_us = last_us
        self.in_slot_before = False
        self.status_us = -1


class Px4Streams:
    """The streams of one link, as PX4 serves them.

    Args:
        rates: message id -> Hz, the rates at boot.
        luck: by which a stream at the full slot rate misses a slot, and positions come when they
            are new; None: every slot is served.
    """

    def __init__(self, rates: Mapping[int, float], *, luck: Random | None) -> None:
        self._defaults = {message: round(1e6 / hz) for message, hz in rates.items()}
        self._luck = luck
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
            if waited < stream.interval_us or nothing_new or self._missed(message_id, slot_us):
                stream.in_slot_before = False
                continue
            # Keep the phase while it is nearly met; start a new one when the slots are too coarse.
            on_time = 2 * waited < 3 * stream.interval_us
            stream.last_us = stream.last_us + stream.interval_us if on_time else slot_us
            stream.in_slot_before = True
            stream.status_us = status_us
            due.append(message_id)
        return due

    def _missed(self, message_id: int, slot_us: int) -> bool:
        """Whether a message that is due misses this slot."""
        if self._luck is None:
            return False
        if slot_us % NEW_EVERY_US.get(message_id, 1):
            return True
        return self._streams[message_id].in_slot_before and self._luck.random() < BUSY_SHARE
