"""Tells ground stations in words (STATUSTEXT) and everyone by number (EVENT)."""

import struct
from collections.abc import Iterable

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.link import Link
from sitl_mock.personality import Occasion, Personality
from sitl_mock.state import State

_EVENT_ID = 410
_EVENT_CRC = 160
_EVENT = struct.Struct("<IIHBBB40s")
_CHUNK = 50


class Announcer:
    """Announces occasions on all links.

    Args:
        state: for the time.
        personality: the words and numbers.
        links: where to.
    """

    def __init__(self, state: State, personality: Personality, links: Iterable[Link]) -> None:
        self._state = state
        self._personality = personality
        self._links = list(links)
        self._event_sequence = 0
        self._text_id = 0

    def __call__(self, occasion: Occasion, detail: str) -> None:
        """Tell of an occasion; ``detail`` goes where its text has room for it."""
        event = self._personality.events[occasion]
        if event.event_id:
            self._send_event(event.event_id, event.severity, event.arguments)
        self._send_text(event.text.format(detail), event.severity)

    def _send_event(self, event_id: int, severity: int, arguments: bytes) -> None:
        payload = _EVENT.pack(
            event_id,
            self._state.shown_us // 1000,
            self._event_sequence,
            0,
            0,
            severity << 4 | severity,
            arguments,
        )
        self._event_sequence = (self._event_sequence + 1) & 0xFFFF
        for link in self._links:
            link.send_raw(_EVENT_ID, _EVENT_CRC, payload)

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
