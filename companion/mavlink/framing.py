"""MAVLink framing: finds frames of versions 1 and 2 in bytes, and builds frames of version 2.

Source: the MAVLink serialization guide. Only intact frames are delivered. The checksum includes the
message's CRC_EXTRA, so a frame of an unknown message cannot be checked. It is skipped unless
`keep_unknown` is true.
"""

import struct
from collections.abc import Mapping
from typing import NamedTuple

from fastcrc import crc16

from companion.mavlink.stats import LinkStats

V2 = 0xFD
"""First byte of a frame of version 2."""
V1 = 0xFE
"""First byte of a frame of version 1."""
SIGNED = 0x01
"""Incompatibility flag of a frame with a signature."""
SIGNATURE_LENGTH = 13

_V2_HEADER = struct.Struct("<BBBBBBBHB")
_V1_HEADER_LENGTH = 6
_V2_HEADER_LENGTH = 10
_INCOMPLETE = -1
_NOT_A_FRAME = 0


class Frame(NamedTuple):
    """One intact frame.

    Attributes:
        message_id: Number of the message.
        system: Source system id.
        component: Source component id.
        sequence: The sender's sequence number, 0..255.
        payload: Payload as sent; version 2 cuts trailing zeros, so pad it before unpacking.
        raw: The whole frame with header, checksum and signature.
        signed: Whether the frame carries a signature; it has not been checked.
    """

    message_id: int
    system: int
    component: int
    sequence: int
    payload: bytes
    raw: bytes
    signed: bool


class FrameScanner:
    """Finds the intact frames in the bytes that arrive.

    Args:
        crc_extra: The dialect's CRC_EXTRA as one byte for each known message id.
        streaming: True if a frame may continue in the next call (TCP, serial). False for
            datagrams: an incomplete frame is dropped.
        stats: Counts wrong checksums and unknown messages.
        keep_unknown: Whether frames of unknown messages are returned too, with their checksum not
            checked. Their id is not in `crc_extra`.
    """

    def __init__(
        self,
        crc_extra: Mapping[int, bytes],
        *,
        streaming: bool = False,
        stats: LinkStats | None = None,
        keep_unknown: bool = False,
    ) -> None:
        self._crc_extra = crc_extra
        self._streaming = streaming
        self._keep_unknown = keep_unknown
        self._stats = stats or LinkStats()
        self._rest = b""

    def feed(self, data: bytes) -> list[Frame]:
        """Take the next bytes; return the frames that they complete, in order."""
        if self._rest:
            data = self._rest + data
            self._rest = b""
        frames: list[Frame] = []
        at, end = 0, len(data)
        while at < end:
            magic = data[at]
            if magic == V2:
                length = self._version_2(data, at, frames)
            elif magic == V1:
                length = self._version_1(data, at, frames)
            else:
                length = _NOT_A_FRAME
            if length == _INCOMPLETE:
                if self._streaming:
                    self._rest = data[at:]
                    break
                length = _NOT_A_FRAME
            at += length or 1
        return frames

    def _version_2(self, data: bytes, at: int, frames: list[Frame]) -> int:
        if len(data) - at < _V2_HEADER_LENGTH:
            return _INCOMPLETE
        # Indexing single bytes is quicker than `struct` when the caches are cold.
        incompatible = data[at + 2]
        if incompatible & ~SIGNED:
            return _NOT_A_FRAME
        message_id = data[at + 7] | data[at + 8] << 8 | data[at + 9] << 16
        check_at = at + _V2_HEADER_LENGTH + data[at + 1]
        end = check_at + (2 + SIGNATURE_LENGTH if incompatible else 2)
        fault = self._fault(data, at, check_at, end, message_id)
        if fault is not None and not (fault == end - at and self._keep_unknown):
            return fault
        frames.append(
            Frame(
                message_id,
                data[at + 5],
                data[at + 6],
                data[at + 4],
                data[at + _V2_HEADER_LENGTH : check_at],
                data[at:end],
                incompatible != 0,
            )
        )
        return end - at

    def _version_1(self, data: bytes, at: int, frames: list[Frame]) -> int:
        if len(data) - at < _V1_HEADER_LENGTH:
            return _INCOMPLETE
        _, size, sequence, system, component, message_id = data[at : at + _V1_HEADER_LENGTH]
        check_at = at + _V1_HEADER_LENGTH + size
        end = check_at + 2
        fault = self._fault(data, at, check_at, end, message_id)
        if fault is not None and not (fault == end - at and self._keep_unknown):
            return fault
        payload = data[at + _V1_HEADER_LENGTH : check_at]
        frames.append(
            Frame(message_id, system, component, sequence, payload, data[at:end], signed=False)
        )
        return end - at

    def _fault(self, data: bytes, at: int, check_at: int, end: int, message_id: int) -> int | None:
        """Check that the bytes `at`..`end` are an intact frame of a known message.

        Returns:
            None if they are; else `_NOT_A_FRAME`, `_INCOMPLETE`, or the length of a frame of an
            unknown message.
        """
        extra = self._crc_extra.get(message_id)
        if extra is None:
            return self._unknown_frame(data, at, end)
        if end > len(data):
            return _INCOMPLETE
        stated = data[check_at] | data[check_at + 1] << 8
        if crc16.mcrf4xx(data[at + 1 : check_at] + extra) == stated:
            return None
        self._stats.bad_crc += 1
        return _NOT_A_FRAME

    def _unknown_frame(self, data: bytes, at: int, end: int) -> int:
        # The checksum cannot tell this frame from garbage. It counts as a frame if another frame
        # or the end of the data follows it.
        if end == len(data) or (end < len(data) and data[end] in (V1, V2)):
            self._stats.unknown += 1
            return end - at
        if self._keep_unknown and end > len(data) and _is_plausible(data, at):
            return _INCOMPLETE
        return _NOT_A_FRAME


def _is_plausible(data: bytes, at: int) -> bool:
    """Whether this may be a version 2 header: no compatibility flags, message id below 65536."""
    return data[at] == V2 and data[at + 3] == 0 and data[at + 9] == 0


def build_frame(
    message_id: int,
    payload: bytes,
    crc_extra: bytes,
    *,
    sequence: int,
    system: int,
    component: int,
    signed: bool = False,
) -> bytes:
    """Build a version 2 frame; with `signed`, the signature must be appended.

    Trailing zeros of the payload are cut, but never its first byte, as MAVLink requires.
    """
    trimmed = payload.rstrip(b"\0") or payload[:1]
    body = (
        _V2_HEADER.pack(
            V2,
            len(trimmed),
            SIGNED if signed else 0,
            0,
            sequence,
            system,
            component,
            message_id & 0xFFFF,
            message_id >> 16,
        )
        + trimmed
    )
    return body + crc16.mcrf4xx(body[1:] + crc_extra).to_bytes(2, "little")
