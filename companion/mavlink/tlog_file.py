"""Reads a `.tlog` of this or another program: the frames in it, with their messages.

A record is the time in microseconds since 1970 (8 bytes, big endian) and then one frame as it was
sent.
"""

import re
from collections.abc import Callable, Iterator, Set
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
from companion.mavlink.messages import CRC_EXTRA, MESSAGE_IDS, Message, decode

_STAMP_BYTES = 8
_SHORTEST_HEADER = 6
_V1_OVERHEAD, _V2_OVERHEAD = 8, 12  # bytes of header and checksum
_LONGEST_DAMAGED_BEGINNING = 1 << 16
"""Largest offset of the first intact frame in a `.tlog` with a damaged beginning, bytes."""
_OTHER_LOG_KINDS = {b"ULog\x01\x12\x35": "a ULog", b"\xa3\x95\x80": "a DataFlash log"}
"""First bytes of the logs that autopilots record themselves, and the kind of each log."""
_MAGIC = re.compile(rb"[\xfd\xfe]")


def messages(
    path: Path, names: Set[str], on_damage: Callable[[str], object] | None = None
) -> Iterator[tuple[Frame, Message]]:
    """The intact frames of the messages with these names, each with its message, in order.

    An incomplete record at the end is left out. So are damaged records: a card that loses power
    leaves some, and some programs also record bytes of the radio that are no frame.

    `names`: names of the messages. `on_damage`: called at the end with a sentence if damaged
    records were left out.

    Raises:
        LogError: the file cannot be read, or is not a `.tlog`.
    """
    reader = _RecordReader(path, {MESSAGE_IDS[name] for name in names})
    for frame in reader.frames():
        yield frame, decode(frame.message_id, frame.payload)
    if reader.damage_offsets and on_damage is not None:
        count = len(reader.damage_offsets)
        on_damage(
            f"{path}: damaged at {count} {'place' if count == 1 else 'places'}, the first after "
            f"{reader.damage_offsets[0]} bytes; the damaged records are left out, all others were "
            "read"
        )


class _RecordReader:
    """Reads the records of a log; after a damaged one it goes on with the next intact frame.

    Attributes:
        damage_offsets: where damaged records begin, bytes after the beginning of the file.
    """

    def __init__(self, path: Path, wanted_ids: Set[int]) -> None:
        self.damage_offsets: list[int] = []
        self._path, self._wanted_ids = path, wanted_ids
        try:
            self._data = path.read_bytes()
        except OSError as error:
            raise LogError(f"{path}: cannot read the log: {error.strerror}") from error
        self._scanner = FrameScanner()

    def frames(self) -> Iterator[Frame]:
        """The intact frames of the wanted messages, in order.

        Raises:
            LogError: the file has no intact record near its beginning.
        """
        start, end_of_data = self._first_frame_start(), len(self._data)
        while start + _SHORTEST_HEADER <= end_of_data:
            frame, end = self._intact_frame(start), start + self._frame_length(start)
            if frame is not None:
                if frame.message_id in self._wanted_ids:
                    yield frame
                start = end + _STAMP_BYTES
            elif self._may_skip(start, end):
                start = end + _STAMP_BYTES
            else:
                next_start = self._next_intact_start(start + 1)
                if next_start is not None or end <= end_of_data:  # otherwise the end is incomplete
                    self.damage_offsets.append(start)
                start = end_of_data if next_start is None else next_start

    def _first_frame_start(self) -> int:
        """Where the frame of the first intact record begins."""
        if self._frame_length(_STAMP_BYTES):
            return _STAMP_BYTES
        if not self._data.strip(b"\0"):  # a crash leaves zeros in a file that was just begun
            raise LogError(f"{self._path} is empty: its flight ended before anything was recorded")
        for beginning, kind in _OTHER_LOG_KINDS.items():
            if self._data.startswith(beginning):
                raise LogError(
                    f"{self._path}: this is {kind}; give the .tlog that a ground station or this "
                    "program recorded"
                )
        first_offset = None
        if self._intact_frame(0) is None:  # otherwise the records have no time
            first_offset = self._next_intact_start(_STAMP_BYTES, _LONGEST_DAMAGED_BEGINNING)
        if first_offset is None:
            raise LogError(
                f"{self._path}: not a .tlog; expected MAVLink frames, each after 8 bytes with its "
                "time"
            )
        self.damage_offsets.append(0)
        return first_offset

    def _may_skip(self, start: int, end: int) -> bool:
        """Whether `start`..`end` may be a frame of a message that is unknown or not wanted.

        The checksum is not used: another dialect may use the same message id for another message.
        """
        if end == start or self._message_id(start) in self._wanted_ids:
            return False
        next_start = end + _STAMP_BYTES
        return end <= len(self._data) <= next_start or bool(self._frame_length(next_start))

    def _next_intact_start(self, begin: int, end: int | None = None) -> int | None:
        """Where the next intact frame of a known message begins, or None."""
        magic_matches = _MAGIC.finditer(self._data, begin, len(self._data) if end is None else end)
        return next(
            (each.start() for each in magic_matches if self._intact_frame(each.start())), None
        )

    def _intact_frame(self, start: int) -> Frame | None:
        """The intact frame of a known message that begins at `start`, or None."""
        raw = self._data[start : start + self._frame_length(start)]
        if not raw or self._message_id(start) not in CRC_EXTRA:
            return None
        frames = self._scanner.feed(raw)
        return frames[0] if frames and frames[0].raw == raw else None

    def _frame_length(self, start: int) -> int:
        """Length of the frame that begins at `start` by its header; 0 if none begins there."""
        header = self._data[start : start + _SHORTEST_HEADER]
        if len(header) < _SHORTEST_HEADER:
            return 0
        magic, size, flags = header[:3]
        if magic == V2_MAGIC:
            return _V2_OVERHEAD + size + (SIGNATURE_LENGTH if flags & SIGNED_FLAG else 0)
        return _V1_OVERHEAD + size if magic == V1_MAGIC else 0

    def _message_id(self, start: int) -> int:
        """The message number in the header of the frame that begins at `start`."""
        if self._data[start] == V1_MAGIC:
            return self._data[start + 5]
        return int.from_bytes(self._data[start + 7 : start + 10], "little")
