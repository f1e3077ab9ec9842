"""MAVLink frames to messages and back, for the mock's side of a link.

pymavlink is the codec. The dialect is ``development`` (a superset of ``common``), as PX4 main
speaks.
"""

import struct
from collections.abc import Callable, Iterable
from itertools import chain
from operator import attrgetter
from typing import Any

from fastcrc import crc16
from pymavlink.dialects.v20 import development as dialect

from sitl_mock.link.event_messages import event_request

Message = Any
"""A pymavlink message object; the generated classes carry no usable types."""

_MAGIC_V1 = 0xFE
_MAGIC_V2 = 0xFD
SIGNED = 0x01
"""Incompatibility flag of a signed frame."""
SIGNATURE_BYTES = 13
_OVERHEAD_V1 = 8
_OVERHEAD_V2 = 12
_FLAGS_AT = 2
_UNTOLD = -1

_HEADER = struct.Struct("<BBBBBBHB")
_CRC = struct.Struct("<H")

_wire_values: dict[Any, Callable[[Message], Iterable[Any]]] = {}
_decoder = dialect.MAVLink(None)


def decode(datagram: bytes) -> list[Message]:
    """Return the valid messages of a datagram in their order; whatever else is in it is skipped.

    MAVLink 1 and 2 frames are taken, signed ones without checking the signature (`Link.accepts`
    does that). A frame may not span datagrams.
    """
    messages: list[Message] = []
    start = 0
    while start < len(datagram):
        length = _announced_length(datagram, start)
        if not 0 < length <= len(datagram) - start:
            start += 1
            continue
        try:
            message = _decoder.decode(bytearray(datagram[start : start + length]))
        except dialect.MAVError:
            start += 1
            continue
        start += length
        if isinstance(message, dialect.MAVLink_unknown):
            message = event_request(message)
        if message is not None:
            messages.append(message)
    return messages


def split(data: bytes) -> tuple[list[bytes], bytes]:
    """Return what seem to be the whole frames in a stream of bytes, and the rest that waits.

    What cannot begin a frame is skipped; whether a frame is intact, `decode` finds out.
    """
    frames: list[bytes] = []
    start = 0
    while start < len(data):
        length = _announced_length(data, start)
        if length == _UNTOLD or length > len(data) - start:
            break
        if length:
            frames.append(data[start : start + length])
        start += length or 1
    return frames, data[start:]


def _announced_length(data: bytes, start: int) -> int:
    """Return the length of the frame whose header is at ``start``.

    0 if no frame begins there, `_UNTOLD` if the data ends before the header tells.
    """
    left = len(data) - start
    if data[start] == _MAGIC_V2:
        if left < _FLAGS_AT + 1:
            return _UNTOLD
        flags = data[start + _FLAGS_AT]
        if flags & ~SIGNED:
            return 0
        return _OVERHEAD_V2 + data[start + 1] + (SIGNATURE_BYTES if flags & SIGNED else 0)
    if data[start] == _MAGIC_V1:
        return _UNTOLD if left < _FLAGS_AT else _OVERHEAD_V1 + data[start + 1]
    return 0


class Framer:
    """Packs messages of one component on one link, as MAVLink 2, counting the sequence number.

    Args:
        system_id: of the sender.
        component_id: of the sender.
        signed: leave each frame to be signed; see `Signing.sign`.
    """

    def __init__(self, system_id: int, component_id: int, *, signed: bool = False) -> None:
        self._system_id = system_id
        self._component_id = component_id
        self._flags = SIGNED if signed else 0
        self._sequence = 0

    def frame(self, message: Message) -> bytes:
        """Return the message's frame."""
        kind = type(message)
        wire_values = _wire_values.get(kind)
        if wire_values is None:
            wire_values = _wire_values[kind] = _wire_order(kind)
        payload = kind.unpacker.pack(*wire_values(message))
        return self.frame_raw(kind.id, kind.crc_extra, payload)

    def frame_raw(self, message_id: int, crc_extra: int, payload: bytes) -> bytes:
        """Return the frame of a message by its full wire payload; trailing zeros are left out."""
        payload = payload.rstrip(b"\0") or b"\0"
        body = _HEADER.pack(
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
        return b"\xfd" + body + _CRC.pack(crc16.mcrf4xx(body + bytes((crc_extra,))))


def _wire_order(kind: Any) -> Callable[[Message], Iterable[Any]]:
    """Return a function from a message of a class to the values of its wire struct.

    pymavlink's own ``pack`` does the same three times slower, which the lockstep budget feels.
    """
    names = kind.ordered_fieldnames
    texts = {
        name for name, kept in zip(kind.fieldnames, kind.fieldtypes, strict=True) if kept == "char"
    }
    fields = attrgetter(*(f"_{name}_raw" if name in texts else name for name in names))
    if len(names) == 1:
        return lambda message: (fields(message),)
    arrays = [
        bool(length) and name not in texts
        for name, length in zip(names, kind.array_lengths, strict=True)
    ]
    if not any(arrays):
        return fields
    return lambda message: chain.from_iterable(
        value if array else (value,) for value, array in zip(fields(message), arrays, strict=True)
    )
