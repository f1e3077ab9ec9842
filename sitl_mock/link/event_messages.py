"""The four messages of the MAVLink events interface, which pymavlink's dialects lack.

Source: MAVLink common, messages 410 to 413. Layouts and CRC_EXTRA follow from its XML; 410 and 411
agree with recorded frames.
"""

import struct
from dataclasses import dataclass
from typing import Any, NamedTuple

from fastcrc import crc16

_HEADER_BYTES = 10
_CRC_BYTES = 2


class Layout(NamedTuple):
    """Id, CRC_EXTRA and payload layout of one message."""

    message_id: int
    crc_extra: int
    payload: struct.Struct


EVENT = Layout(410, 160, struct.Struct("<IIHBBB40s"))
"""Fields: id, event_time_boot_ms, sequence, destination component and system, log_levels,
arguments."""
CURRENT_EVENT_SEQUENCE = Layout(411, 106, struct.Struct("<HB"))
"""Fields: sequence, flags."""
REQUEST_EVENT = Layout(412, 33, struct.Struct("<HHBB"))
"""Fields: first_sequence, last_sequence, target system and component."""
RESPONSE_EVENT_ERROR = Layout(413, 77, struct.Struct("<HHBBB"))
"""Fields: sequence, sequence_oldest_available, target system and component, reason."""


@dataclass(frozen=True)
class EventRequest:
    """A received REQUEST_EVENT, with those methods of a pymavlink message that the mock calls."""

    frame: bytes
    first_sequence: int
    last_sequence: int
    target_system: int
    target_component: int

    def get_type(self) -> str:
        """Return the message's name."""
        return "REQUEST_EVENT"

    def get_msgbuf(self) -> bytes:
        """Return the whole frame."""
        return self.frame

    def get_srcSystem(self) -> int:  # noqa: N802 - pymavlink's name
        """Return the sender's system id."""
        return self.frame[5]

    def get_srcComponent(self) -> int:  # noqa: N802
        """Return the sender's component id."""
        return self.frame[6]


def event_request(message: Any) -> EventRequest | None:
    """Decode a message unknown to pymavlink; None if it is not a valid REQUEST_EVENT."""
    frame = bytes(message.get_msgbuf())
    if frame[0] != 0xFD or int.from_bytes(frame[7:10], "little") != REQUEST_EVENT.message_id:
        return None
    end = _HEADER_BYTES + frame[1]
    body = frame[1:end] + bytes([REQUEST_EVENT.crc_extra])
    if crc16.mcrf4xx(body) != int.from_bytes(frame[end : end + _CRC_BYTES], "little"):
        return None
    size = REQUEST_EVENT.payload.size
    payload = frame[_HEADER_BYTES:end][:size].ljust(size, b"\0")
    return EventRequest(frame, *REQUEST_EVENT.payload.unpack(payload))
