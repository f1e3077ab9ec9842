"""STATUSTEXT, in as many messages as a text needs."""

from collections.abc import Iterable, Iterator

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.link.framing import Message
from sitl_mock.link.link import Link

_LENGTH = 50
"""Length of STATUSTEXT.text, bytes."""


def is_long(text: str) -> bool:
    """Return whether a text needs several messages."""
    return len(text.encode()) > _LENGTH


def send_text(links: Iterable[Link], text: str, severity: int, text_id: int) -> None:
    """Send a text on links; ``severity`` is MAV_SEVERITY, ``text_id`` joins its messages."""
    for link in links:
        for message in _messages(text.encode(), severity, text_id):
            link.send(message)


def _messages(data: bytes, severity: int, text_id: int) -> Iterator[Message]:
    for number, start in enumerate(range(0, len(data), _LENGTH)):
        chunk = data[start : start + _LENGTH]
        yield dialect.MAVLink_statustext_message(severity, chunk, text_id, number)
