"""ArduPilot's stream schedule: intervals in whole milliseconds, sent in cycles of the main loop.

A link sends only HEARTBEAT and TIMESYNC until a client requests messages. An interval is truncated
to whole milliseconds. An interval shorter than the main loop's period is refused, and the old one
stays. A message is sent in the first cycle after it is due and keeps its phase: 3 ms with the
400 Hz loop gives four steps of 2.5 ms and one of 5 ms, 333 Hz on average.
"""

from collections.abc import Mapping

MAX_INTERVAL_MS = 60_000
"""Longest interval of a stream, ms; a longer requested interval is shortened to this one."""


class ArduPilotStreams:
    """The stream schedule of one link.

    Args:
        rates: message id -> Hz at boot.
        loop_us: period of the main loop.
        booting_until_us: before this time only the streams of the boot are sent.
    """

    def __init__(
        self, rates: Mapping[int, float], *, loop_us: int, booting_until_us: float
    ) -> None:
        self._boot_intervals_us = {message_id: round(1e6 / hz) for message_id, hz in rates.items()}
        self._loop_us = loop_us
        self._booting_until_us = booting_until_us
        self._intervals_us = dict(self._boot_intervals_us)
        self._last_due_us = dict.fromkeys(self._boot_intervals_us, 0)

    def set_interval(self, message_id: int, interval_us: float, now_us: int) -> str | None:
        """Set the interval of a message; 0 = the rate at boot, negative = never.

        Returns:
            the reason for a refusal in ArduPilot's words, None if accepted.
        """
        if interval_us < 0.0:
            self._intervals_us.pop(message_id, None)
            return None
        rounded_us = 1000 * min(int(interval_us) // 1000, MAX_INTERVAL_MS)
        if interval_us == 0.0:
            rounded_us = self._boot_intervals_us.get(message_id, 0)
            if not rounded_us:
                self._intervals_us.pop(message_id, None)
                return None
        if rounded_us < self._loop_us:
            return f"Requested rate for message ID {message_id} too fast. Increase SCHED_LOOP_RATE"
        self._intervals_us[message_id] = rounded_us
        self._last_due_us[message_id] = now_us
        return None

    def interval(self, message_id: int) -> int:
        """Return the interval of a message in us, -1 if it is not streamed."""
        return self._intervals_us.get(message_id, -1)

    def due(self, slot_us: int, status_published_us: int = 0) -> list[int]:
        """Return the ids of the messages due in the slot at ``slot_us``, and count them as sent.

        ``status_published_us`` (for PX4) is ignored.
        """
        due_ids = []
        booting = slot_us < self._booting_until_us
        last_due_us = self._last_due_us
        for message_id, interval_us in self._intervals_us.items():
            since_due_us = slot_us - last_due_us[message_id]
            if since_due_us < interval_us or (
                booting and message_id not in self._boot_intervals_us
            ):
                continue
            # More than one interval late, the phase restarts, so that no message is sent twice.
            last_due_us[message_id] = (
                slot_us if since_due_us >= 2 * interval_us else slot_us - since_due_us + interval_us
            )
            due_ids.append(message_id)
        return due_ids
