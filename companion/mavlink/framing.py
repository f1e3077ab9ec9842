"""MAVLink framing: finds frames of versions 1 and 2 in bytes, and builds frames of version 2.

Source: the MAVLink serialization guide. Only intact frames are delivered. The checksum includes the
message's CRC_EXTRA, so a frame of an unknown message cannot be checked. Frames of unknown messages
are skipped unless `keep_unknown` is true.
"""

import struct
from typing import NamedTuple

from fastcrc import crc16

from companion.mavlink.messages import CRC_EXTRA
from companion.mavlink.stats import LinkStats

V2_MAGIC = 0xFD
"""First byte of a frame of version 2."""
V1_MAGIC = 0xFE
"""First byte of a frame of version 1."""
SIGNED_FLAG = 0x01
"""Incompatibility flag of a frame with a signature."""
SIGNATURE_LENGTH = 13

_V2_HEADER = struct.Struct("<BBBBBBBHB")
_V1_HEADER_LENGTH = 6
_V2_HEADER_LENGTH = 10
_INCOMPLETE = -1
_NOT_A_FRAME = 0


class Frame(NamedTuple):
    """One intact frame."""

    message_id: int
    system: int
    """Source system id."""
    component: int
    """Source component id."""
    sequence: int
    """The sender's sequence number, 0..255."""
    payload: bytes
    """Payload as sent; version 2 cuts trailing zeros, so pad it before unpacking."""
    raw: bytes
    """The whole frame with header, checksum and signature."""
    signed: bool
    """Whether the frame carries a signature; it has not been checked."""


class FrameScanner:
    """Finds the intact frames in the bytes that arrive.

    Args:
        streaming: True if a frame may continue in the next call (TCP, serial). False for
            datagrams: an incomplete frame is dropped.
        keep_unknown: whether frames of unknown messages (id not in `CRC_EXTRA`) are returned too;
            their checksum cannot be checked.
    """

    def __init__(
        self, *, streaming: bool = False, stats: LinkStats | None = None, keep_unknown: bool = False
    ) -> None:
        self._streaming = streaming
        self._keep_unknown = keep_unknown
        self._stats = stats or LinkStats()
        self._incomplete_frame = b""

    def feed(self, data: bytes) -> list[Frame]:
        """Take the next bytes; return the frames that they complete, in order."""
        if self._incomplete_frame:
            data = self._incomplete_frame + data
            self._incomplete_frame = b""
        frames: list[Frame] = []
        start, end = 0, len(data)
        while start < end:
            magic = data[start]
            if magic == V2_MAGIC:
                length = self._scan_version_2(data, start, frames)
            elif magic == V1_MAGIC:
                length = self._scan_version_1(data, start, frames)
            else:
                length = _NOT_A_FRAME
            if length == _INCOMPLETE:
                if self._streaming:
                    self._incomplete_frame = data[start:]
                    break
                length = _NOT_A_FRAME
            start += length or 1
        return frames

    def _scan_version_2(self, data: bytes, start: int, frames: list[Frame]) -> int:
        if len(data) - start < _V2_HEADER_LENGTH:
            return _INCOMPLETE
        # Indexing single bytes is quicker than `struct` when the caches are cold.
        incompatible_flags = data[start + 2]
        if incompatible_flags & ~SIGNED_FLAG:
            return _NOT_A_FRAME
        message_id = data[start + 7] | data[start + 8] << 8 | data[start + 9] << 16
        checksum_start = start + _V2_HEADER_LENGTH + data[start + 1]
        end = checksum_start + (2 + SIGNATURE_LENGTH if incompatible_flags else 2)
        skipped = self._skipped_length(data, start, checksum_start, end, message_id)
        if skipped is not None:
            return skipped
        frames.append(
            Frame(
                message_id,
                data[start + 5],
                data[start + 6],
                data[start + 4],
                data[start + _V2_HEADER_LENGTH : checksum_start],
                data[start:end],
                incompatible_flags != 0,
            )
        )
        return end - start

    def _scan_version_1(self, data: bytes, start: int, frames: list[Frame]) -> int:
        if len(data) - start < _V1_HEADER_LENGTH:
            return _INCOMPLETE
        _, size, sequence, system, component, message_id = data[start : start + _V1_HEADER_LENGTH]
        checksum_start = start + _V1_HEADER_LENGTH + size
        end = checksum_start + 2
        skipped = self._skipped_length(data, start, checksum_start, end, message_id)
        if skipped is not None:
            return skipped
        payload = data[start + _V1_HEADER_LENGTH : checksum_start]
        frames.append(
            Frame(message_id, system, component, sequence, payload, data[start:end], signed=False)
        )
        return end - start

    def _skipped_length(
        self, data: bytes, start: int, checksum_start: int, end: int, message_id: int
    ) -> int | None:
        """Check whether the bytes `start`..`end` are a frame to return.

        Returns:
            None if they are; else `_NOT_A_FRAME`, `_INCOMPLETE`, or the length of a frame of an
            unknown message, which is skipped.
        """
        crc_extra = CRC_EXTRA.get(message_id)
        if crc_extra is None:
            return self._skipped_length_of_unknown(data, start, end)
        if end > len(data):
            return _INCOMPLETE
        received_checksum = data[checksum_start] | data[checksum_start + 1] << 8
        if crc16.mcrf4xx(data[start + 1 : checksum_start] + crc_extra) == received_checksum:
            return None
        self._stats.bad_crc += 1
        return _NOT_A_FRAME

    def _skipped_length_of_unknown(self, data: bytes, start: int, end: int) -> int | None:
        # Without CRC_EXTRA the checksum cannot be checked. The bytes count as a frame if another
        # frame or the end of the data follows them.
        if end == len(data) or (end < len(data) and data[end] in (V1_MAGIC, V2_MAGIC)):
            self._stats.unknown += 1
            return None if self._keep_unknown else end - start
        if self._keep_unknown and end > len(data) and _is_plausible(data, start):
            return _INCOMPLETE
        return _NOT_A_FRAME


def _is_plausible(data: bytes, start: int) -> bool:
    """Whether a version 2 header may begin at `start`: compat_flags 0, message id below 65536."""
    return data[start] == V2_MAGIC and data[start + 3] == 0 and data[start + 9] == 0


def build_frame(
    message_id: int,
    payload: bytes,
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
            V2_MAGIC,
            len(trimmed),
            SIGNED_FLAG if signed else 0,
            0,
            sequence,
            system,
            component,
            message_id & 0xFFFF,
            message_id >> 16,
        )
        + trimmed
    )
    return body + crc16.mcrf4xx(body[1:] + CRC_EXTRA[message_id]).to_bytes(2, "little")
