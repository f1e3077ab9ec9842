"""STATUSTEXT: joins the pieces of received texts, and makes frames of texts for a log."""

from collections import deque
from typing import NamedTuple

from companion.files.ascii_text import ascii_for
from companion.mavlink.framing import build_frame
from companion.mavlink.messages import Message, dialect, encode

_CHUNK_CHARACTERS = 50
MAX_TEXT_ID = 0xFFFF
_MAX_TEXTS = 100
_REPETITION_TIME_S = 1.0


class StatusText(NamedTuple):
    """A text of the autopilot."""

    time: float
    """Event-loop time at which the last piece arrived, s."""
    severity: int
    """MAV_SEVERITY, 0 emergency to 7 debug."""
    text: str


class TextAssembler:
    """Joins the pieces of long texts. The newest 100 texts are kept in `texts`.

    If a new text begins before the previous text is complete, the incomplete text is kept as it is.
    A text that PX4 sends both as STATUSTEXT and as event is kept once.
    """

    def __init__(self) -> None:
        self.texts: deque[StatusText] = deque(maxlen=_MAX_TEXTS)
        self._text_id = 0
        self._pieces: list[str] = []
        self._severity = 6
        self._events: deque[StatusText] = deque(maxlen=_MAX_TEXTS)

    def take_event(self, severity: int, text: str, now: float) -> None:
        """Take the text of an event, with its MAV_SEVERITY; `now` is event-loop time, s."""
        if not _is_repetition(self.texts, text, now):
            event = StatusText(now, severity, text)
            self.texts.append(event)
            self._events.append(event)

    def take(self, message: Message, now: float) -> None:
        """Take one STATUSTEXT at the event-loop time `now`, s."""
        text: str = message.text
        if message.id == 0:
            self._finish(now)
            self._append_text(now, message.severity, text)
            return
        if message.id != self._text_id:
            self._finish(now)
            self._text_id = message.id
        self._severity = message.severity
        self._pieces.append(text)
        if len(text) < _CHUNK_CHARACTERS:  # a shorter piece is the last one
            self._finish(now)

    def texts_since(self, start: float) -> tuple[str, ...]:
        """All texts that arrived at the event-loop time `start` (s) or later."""
        return tuple(entry.text for entry in self.texts if entry.time >= start)

    def _finish(self, now: float) -> None:
        if self._pieces:
            self._append_text(now, self._severity, "".join(self._pieces))
        self._text_id, self._pieces = 0, []

    def _append_text(self, now: float, severity: int, text: str) -> None:
        text = text.strip()
        if text and not _is_repetition(self._events, text, now):
            self.texts.append(StatusText(now, severity, text))


def _is_repetition(texts: deque[StatusText], text: str, now: float) -> bool:
    """Whether the same text is among those of `texts` from the last second."""
    return any(each.text == text for each in texts if each.time >= now - _REPETITION_TIME_S)


def status_texts(text: str, severity: int, text_id: int) -> list[Message]:
    """The STATUSTEXTs of an ASCII text: a text over 50 characters is cut into pieces of 50.

    `severity`: MAV_SEVERITY. `text_id`: number that joins the pieces of one text, 1..65535; not
    used for a single piece.
    """
    if len(text) <= _CHUNK_CHARACTERS:
        return [dialect.MAVLink_statustext_message(severity, text.encode("ascii"))]
    return [
        dialect.MAVLink_statustext_message(
            severity, text[start : start + _CHUNK_CHARACTERS].encode("ascii"), text_id, order
        )
        for order, start in enumerate(range(0, len(text) + 1, _CHUNK_CHARACTERS))
    ]


class TextFrames:
    """Makes STATUSTEXT frames with texts of this program, for a log; they are not sent.

    The component id of the frames is MAV_COMP_ID_LOG. With this program's own component id, their
    sequence numbers would make other frames look lost.
    """

    def __init__(self, system: int) -> None:
        self._system = system
        self._sequence = self._id = 0

    def frames(self, text: str) -> list[bytes]:
        """The frames of a text, in ASCII, with at most 50 characters each, in order."""
        self._id = self._id % MAX_TEXT_ID + 1
        messages = status_texts(ascii_for(text), dialect.MAV_SEVERITY_INFO, self._id)
        return [self._frame(message) for message in messages]

    def _frame(self, message: Message) -> bytes:
        self._sequence = (self._sequence + 1) & 0xFF
        return build_frame(
            message.get_msgId(),
            encode(message),
            sequence=self._sequence,
            system=self._system,
            component=dialect.MAV_COMP_ID_LOG,
        )
