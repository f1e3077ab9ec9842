"""When each telemetry message of a link is due, whatever the autopilot's way of seeing to it."""

from typing import Protocol


class StreamSchedule(Protocol):
    """The streams of one link."""

    def set_interval(self, message_id: int, interval_us: float, now_us: int) -> str | None:
        """Ask for a message every ``interval_us``; 0 = the rate at boot, negative = never.

        Returns:
            why it is refused, in words; None: it is not.
        """

    def interval(self, message_id: int) -> int:
        """Return the interval in us that is set for a message, -1 if it is not streamed."""

    def due(self, slot_us: int, status_us: int = 0) -> list[int]:
        """Return the ids of the messages to send in the slot at ``slot_us``; they count as sent."""
