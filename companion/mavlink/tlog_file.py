"""Reads a `.tlog` of this or another program: the frames in it, with their messages.

A record is the time in microseconds since 1970 (8 bytes, big endian) and then one frame as it was
sent.
"""

from collections.abc import Iterator, Set
from pathlib import Path

from companion.mavlink.errors import LogError
from companion.mavlink.framing import (
    SIGNATURE_LENGTH,
    SIGNED_FLAG,
    V1_MAGIC,
    V2_MAGIC,
    Frame,
    FrameScanner,
)
from companion.mavlink.messages import MESSAGE_IDS, Message, decode

_STAMP_BYTES = 8
_V1_OVERHEAD, _V2_OVERHEAD = 8, 12  # bytes of header and checksum


def messages(path: Path, names: Set[str]) -> Iterator[tuple[Frame, Message]]:
    """The intact frames of the messages with these names, each with its message, in order.

    An incomplete record at the end is left out.

    Raises:
        LogError: the file cannot be read, is damaged, or is not a `.tlog`.
    """
    wanted = {MESSAGE_IDS[name] for name in names}
    scanner = FrameScanner()
    for raw in _records(path):
        for frame in scanner.feed(raw):
            if frame.message_id in wanted:
                yield frame, decode(frame.message_id, frame.payload)


def _records(path: Path) -> Iterator[bytes]:
    """The frames as bytes, without their time stamps."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise LogError(f"{path}: cannot read the log: {error.strerror}") from error
    start = _STAMP_BYTES
    while start + 3 <= len(data):
        magic, size, flags = data[start : start + 3]
        if magic == V2_MAGIC:
            end = start + _V2_OVERHEAD + size + (SIGNATURE_LENGTH if flags & SIGNED_FLAG else 0)
        elif magic == V1_MAGIC:
            end = start + _V1_OVERHEAD + size
        elif start == _STAMP_BYTES:
            break
        else:
            raise LogError(f"{path}: damaged after {start} bytes: no MAVLink frame begins there")
        yield data[start:end]
        start = end + _STAMP_BYTES
    if start == _STAMP_BYTES:
        raise LogError(
            f"{path}: not a .tlog; expected MAVLink frames, each after 8 bytes with its time"
        )
