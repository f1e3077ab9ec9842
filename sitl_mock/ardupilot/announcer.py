"""Tells in words, as ArduPilot does: on every link on which somebody has spoken."""

from collections.abc import Iterable

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.ardupilot.texts import ARDUPILOT_EVENTS
from sitl_mock.autopilot.personality import Occasion
from sitl_mock.link.link import Link

_CHUNK = 50


class ArduPilotAnnouncer:
    """Announces occasions, and says texts of no occasion.

    Args:
        links: where to.
    """

    def __init__(self, links: Iterable[Link]) -> None:
        self._links = list(links)
        self._long_texts = 0

    def __call__(self, occasion: Occasion, detail: str) -> None:
        """Tell of an occasion, unless ArduPilot keeps it to itself."""
        event = ARDUPILOT_EVENTS.get(occasion)
        if event is not None:
            self.say(event.text.format(detail), event.severity)

    def say(self, text: str, severity: int) -> None:
        """Send a text; only one that needs several chunks has an id (recorded)."""
        data = text.encode()
        chunks = [data[start : start + _CHUNK] for start in range(0, len(data), _CHUNK)]
        if len(chunks) > 1:
            self._long_texts += 1
        text_id = self._long_texts if len(chunks) > 1 else 0
        for link in self._links:
            if not link.heard:
                continue
            for number, chunk in enumerate(chunks):
                link.send(dialect.MAVLink_statustext_message(severity, chunk, text_id, number))
