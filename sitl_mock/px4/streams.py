"""PX4's stream schedule: requested intervals, rounded to the slots of its MAVLink loop.

A slot comes every 4 ms with a 250 Hz inner loop, every 2.5 ms with 800 Hz. So the achieved rate
differs from the requested one. The rules below reproduce the rates measured on PX4: requested
100/200/400/500/1000 Hz gave 99/124/191/189/199 with the 250 Hz loop and 98/196/392/392/392 with 800
Hz; 250 Hz gave 190 to 235, in steps of 4 and 8 ms; a position at 50 Hz comes in steps of 16 and
24 ms. With a 100 Hz loop, which was not measured, a slot comes every 10 ms.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from random import Random

SLOT_PERIOD_US = {100: 10_000, 250: 4000, 800: 2500}
"""Slot period in us of vehicle time by inner loop rate in Hz."""

HEARTBEAT, LOCAL_POSITION_NED, CURRENT_MODE = 0, 32, 436

SLOT_MISS_PROBABILITY = 0.22
"""Probability that a stream sent in one slot misses the next (250 Hz loop only; measured: 0.17 in
one flight, 0.23 in another)."""

VALUE_PERIOD_US = {LOCAL_POSITION_NED: 8000}
"""Message id -> period of new values, us; without `exact_rates`, no value is sent twice."""


@dataclass(eq=False, slots=True)
class _Stream:
    message_id: int
    interval_us: int
    due_us: int
    sent_us: int | None = None
    """Vehicle time of the latest slot in which the message was sent, us."""
    status_published_us: int = -1
    """Vehicle time of the latest status published before the message was last sent, us."""


class Px4Streams:
    """The stream schedule of one link.

    Args:
        rates: message id -> Hz, the rates at boot.
        random: draws the slots that a stream at the full slot rate misses; positions then also
            wait for a new value. None = no slot is missed.
    """

    def __init__(self, rates: Mapping[int, float], *, random: Random | None) -> None:
        self._boot_intervals_us = {message_id: round(1e6 / hz) for message_id, hz in rates.items()}
        self._random = random
        self._last_slot_us: int | None = None
        self._streams = {
            message_id: _Stream(message_id, interval_us, 0)
            for message_id, interval_us in self._boot_intervals_us.items()
        }

    def set_interval(self, message_id: int, interval_us: float, now_us: int) -> str | None:
        """Set the interval of a message; 0 = the rate at boot, negative = never.

        Returns:
            the reason for a refusal, None if accepted; PX4 refuses only HEARTBEAT.
        """
        if message_id == HEARTBEAT:
            return "the rate of HEARTBEAT is fixed"
        interval = round(interval_us)
        if interval == 0:
            interval = self._boot_intervals_us.get(message_id, -1)
        if interval < 0:
            self._streams.pop(message_id, None)
        else:
            self._streams[message_id] = _Stream(message_id, interval, now_us + interval)
        return None

    def interval(self, message_id: int) -> int:
        """Return the interval of a message in us, -1 if it is not streamed."""
        stream = self._streams.get(message_id)
        return -1 if stream is None else stream.interval_us

    def due(self, slot_us: int, status_published_us: int = 0) -> list[int]:
        """Return the ids of the messages due in the slot at ``slot_us``, and count them as sent.

        CURRENT_MODE is sent at most once per publication of the vehicle status, the latest of which
        was at ``status_published_us`` (measured: 2 Hz of 20 Hz requested).
        """
        due_ids = []
        for stream in self._streams.values():
            lateness_us = slot_us - stream.due_us
            if lateness_us < 0:
                continue
            message_id = stream.message_id
            is_same_status = stream.status_published_us == status_published_us
            if (message_id == CURRENT_MODE and is_same_status) or self._misses_slot(
                stream, slot_us
            ):
                continue
            # Keep the phase while the stream is nearly on time, else restart it.
            nearly_on_time = 2 * lateness_us < stream.interval_us
            stream.due_us = (stream.due_us if nearly_on_time else slot_us) + stream.interval_us
            stream.sent_us = slot_us
            stream.status_published_us = status_published_us
            due_ids.append(message_id)
        self._last_slot_us = slot_us
        return due_ids

    def _misses_slot(self, stream: _Stream, slot_us: int) -> bool:
        """Whether a due message misses the slot at ``slot_us``."""
        if self._random is None:
            return False
        if slot_us % VALUE_PERIOD_US.get(stream.message_id, 1):
            return True
        sent_in_last_slot = stream.sent_us is not None and stream.sent_us == self._last_slot_us
        return sent_in_last_slot and self._random.random() < SLOT_MISS_PROBABILITY
