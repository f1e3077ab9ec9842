"""When ArduPilot sends each telemetry message of a link: whole milliseconds, turns of its loop.

A link is silent but for HEARTBEAT and TIMESYNC until messages are asked for. An interval is cut to
whole milliseconds; one shorter than a turn of the main loop is refused and the old one kept. A
message leaves at the first turn after it is due, its phase kept: asked for 3 ms with the 400 Hz
loop, it comes after 2.5, 2.5, 5 ms, ... (recorded), 333 Hz on the whole.
"""

from collections.abc import Collection, Mapping

LONGEST_MS = 60_000
"""A longer interval than this counts as this."""


class ArduPilotStreams:
    """The streams of one link.

    Args:
        rates: message id -> Hz at boot.
        supported: ids of the messages that can be asked for.
        loop_us: a turn of the main loop.
        silent_until_us: before, only the streams of the boot leave.
    """

    def __init__(
        self,
        rates: Mapping[int, float],
        supported: Collection[int],
        *,
        loop_us: int,
        silent_until_us: float,
    ) -> None:
        self._defaults = {message: round(1e6 / hz) for message, hz in rates.items()}
        self._supported = supported
        self._loop_us = loop_us
        self._silent_until_us = silent_until_us
        self._intervals = dict(self._defaults)
        self._last = dict.fromkeys(self._defaults, 0)

    def set_interval(self, message_id: int, interval_us: float, now_us: int) -> str | None:
        """Ask for a message every ``interval_us``; 0 = as at boot, negative = never.

        Returns:
            why it is refused, in ArduPilot's words; None: it is not.
        """
        if message_id not in self._supported:
            return f"No ap_message for mavlink id ({message_id})"
        if interval_us < 0.0:
            self._intervals.pop(message_id, None)
            return None
        interval = 1000 * min(int(interval_us) // 1000, LONGEST_MS)
        if interval_us == 0.0:
            interval = self._defaults.get(message_id, 0)
            if not interval:
                self._intervals.pop(message_id, None)
                return None
        if interval < self._loop_us:
            return f"Requested rate for message ID {message_id} too fast. Increase SCHED_LOOP_RATE"
        self._intervals[message_id] = interval
        self._last[message_id] = now_us
        return None

    def interval(self, message_id: int) -> int:
        """Return the interval in us that is set for a message, -1 if it is not streamed."""
        return self._intervals.get(message_id, -1)

    def due(self, slot_us: int, status_us: int = 0) -> list[int]:
        """Return the ids of the messages to send in the slot at ``slot_us``; they count as sent."""
        due = []
        for message_id, interval in self._intervals.items():
            if slot_us < self._silent_until_us and message_id not in self._defaults:
                continue
            last = self._last[message_id]
            if slot_us - last < interval:
                continue
            # More than a whole interval late, the phase is given up: nothing is sent twice.
            late = slot_us - last >= 2 * interval
            self._last[message_id] = slot_us if late else last + interval
            due.append(message_id)
        return due
