"""Tells ground stations in words (STATUSTEXT), and by number (EVENT) where the family has them."""

from collections.abc import Iterable
from typing import Protocol

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.autopilot.personality import Occasion, Personality
from sitl_mock.link.link import Link

_CHUNK = 50


class EventSender(Protocol):
    """Sends numbered events; see `px4_event_log.EventLog`."""

    def send(
        self, event_id: int, severity: int, internal: int | None = None, arguments: bytes = b""
    ) -> None:
        """Send a new event."""


class Announcer:
    """Announces occasions on all links.

    Args:
        personality: the words and numbers.
        links: where to.
        events: sends the numbers; None = the family has none.
    """

    def __init__(
        self, personality: Personality, links: Iterable[Link], events: EventSender | None = None
    ) -> None:
        self._personality = personality
        self._links = list(links)
        self._events = events
        self._text_id = 0

    def __call__(self, occasion: Occasion, detail: str, arguments: bytes = b"") -> None:
        """Tell of an occasion.

        Args:
            occasion: what happened.
            detail: goes where its text has room for it.
            arguments: values of its event that differ from time to time, packed.
        """
        event = self._personality.events[occasion]
        if event.event_id and self._events is not None:
            self._events.send(
                event.event_id, event.severity, event.internal, arguments or event.arguments
            )
        self._send_text(event.text.format(detail), event.severity)

    def _send_text(self, text: str, severity: int) -> None:
        """Send a text, in chunks when it is long, only where a ground station listens."""
        data = text.encode()
        chunks = [data[start : start + _CHUNK] for start in range(0, len(data), _CHUNK)]
        for link in self._links:
            if not link.gcs_heard:
                continue
            for number, chunk in enumerate(chunks):
                link.send(
                    dialect.MAVLink_statustext_message(severity, chunk, self._text_id, number)
                )
        self._text_id = (self._text_id + 1) & 0xFFFF
