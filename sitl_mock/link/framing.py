"""Decodes and encodes MAVLink frames on the vehicle's side of a link.

Messages are pymavlink's objects. The dialect is ``development``, as in PX4 main: a superset of
``common``.
"""

import struct
from typing import Any

from fastcrc import crc16
from pymavlink.dialects.v20 import development as dialect

from sitl_mock.link.event_messages import event_request
from sitl_mock.link.payload import Message, pack, unpack

__all__ = ["SIGNATURE_BYTES", "SIGNED_FLAG", "Framer", "Message", "decode", "split_frames"]

_MAGIC_V1 = 0xFE
_MAGIC_V2 = 0xFD
SIGNED_FLAG = 0x01
SIGNATURE_BYTES = 13
_OVERHEAD_V1 = 8
_OVERHEAD_V2 = 12
_FLAGS_OFFSET = 2
_PAYLOAD_OFFSET = 10
_UNKNOWN_LENGTH = -1

_HEADER_LAYOUT = struct.Struct("<BBBBBBHB")
_CRC_LAYOUT = struct.Struct("<H")

_decoder = dialect.MAVLink(None)


def decode(datagram: bytes) -> list[Message]:
    """Return the valid messages of a datagram in order; other bytes are skipped.

    MAVLink 1 and 2 are accepted. `Link.accepts` checks signatures. A frame must not span datagrams.
    """
    messages: list[Message] = []
    start = 0
    while start < len(datagram):
        length = _announced_length(datagram, start)
        if not 0 < length <= len(datagram) - start:
            start += 1
            continue
        frame = datagram[start : start + length]
        known_class = dialect.mavlink_map.get(_message_id(frame)) if frame[0] == _MAGIC_V2 else None
        valid, message = (
            _decode_by_pymavlink(frame)
            if known_class is None
            else _decode_known(frame, known_class)
        )
        start += length if valid else 1
        if message is not None:
            messages.append(message)
    return messages


def _message_id(frame: bytes) -> int:
    return frame[7] | frame[8] << 8 | frame[9] << 16


def _decode_known(frame: bytes, message_class: Any) -> tuple[bool, Message | None]:
    """Decode a MAVLink 2 frame of a message class; return whether it is valid, and the message."""
    end = _PAYLOAD_OFFSET + frame[1]
    received_crc = frame[end] | frame[end + 1] << 8
    if crc16.mcrf4xx(frame[1:end] + bytes((message_class.crc_extra,))) != received_crc:
        return False, None
    message = unpack(message_class, frame[_PAYLOAD_OFFSET:end])
    message._msgbuf = bytearray(frame)
    header = message.get_header()
    header.mlen, header.incompat_flags, header.compat_flags = frame[1:4]
    header.seq, header.srcSystem, header.srcComponent = frame[4:7]
    return True, message


def _decode_by_pymavlink(frame: bytes) -> tuple[bool, Message | None]:
    """Decode a frame of MAVLink 1, or of a message that the dialect lacks."""
    try:
        message = _decoder.decode(bytearray(frame))
    except dialect.MAVError:
        return False, None
    return True, event_request(message) if isinstance(message, dialect.MAVLink_unknown) else message


def split_frames(data: bytes) -> tuple[list[bytes], bytes]:
    """Return the complete frames in a byte stream, and the remaining bytes.

    Bytes that cannot begin a frame are skipped. `decode` checks whether a frame is valid.
    """
    frames: list[bytes] = []
    start = 0
    while start < len(data):
        length = _announced_length(data, start)
        if length == _UNKNOWN_LENGTH or length > len(data) - start:
            break
        if length:
            frames.append(data[start : start + length])
        start += length or 1
    return frames, data[start:]


def _announced_length(data: bytes, start: int) -> int:
    """Return the length of the frame whose header is at ``start``.

    0 if no frame begins there, `_UNKNOWN_LENGTH` if the header is incomplete.
    """
    available = len(data) - start
    if data[start] == _MAGIC_V2:
        if available < _FLAGS_OFFSET + 1:
            return _UNKNOWN_LENGTH
        flags = data[start + _FLAGS_OFFSET]
        if flags & ~SIGNED_FLAG:
            return 0
        return _OVERHEAD_V2 + data[start + 1] + (SIGNATURE_BYTES if flags & SIGNED_FLAG else 0)
    if data[start] == _MAGIC_V1:
        return _UNKNOWN_LENGTH if available < _FLAGS_OFFSET else _OVERHEAD_V1 + data[start + 1]
    return 0


class Framer:
    """Packs the MAVLink 2 frames of one component on one link, with their sequence numbers.

    Args:
        signed: set the flag of signed frames; `Signing.sign` appends the signature.
    """

    def __init__(self, system_id: int, component_id: int, *, signed: bool = False) -> None:
        self._system_id = system_id
        self._component_id = component_id
        self._flags = SIGNED_FLAG if signed else 0
        self._sequence = 0

    def frame(self, message: Message) -> bytes:
        """Return the message's frame."""
        message_class = type(message)  # a message may have a field named `id`
        return self.frame_raw(message_class.id, message_class.crc_extra, pack(message))

    def frame_raw(self, message_id: int, crc_extra: int, payload: bytes) -> bytes:
        """Return the frame of a message given as payload; trailing zeros are truncated."""
        payload = payload.rstrip(b"\0") or b"\0"
        body = _HEADER_LAYOUT.pack(
            len(payload),
            self._flags,
            0,
            self._sequence,
            self._system_id,
            self._component_id,
            message_id & 0xFFFF,
            message_id >> 16,
        )
        self._sequence = (self._sequence + 1) & 0xFF
        body += payload
        return b"\xfd" + body + _CRC_LAYOUT.pack(crc16.mcrf4xx(body + bytes((crc_extra,))))
