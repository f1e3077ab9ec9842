"""Writes the flight's MAVLink frames, sent and received, as a `.tlog`, which ground stations read.

A record is the time in microseconds since 1970 (if the flight runs in vehicle time: since the
vehicle's boot), 8 bytes big endian, then the frame as it was sent.
"""

import os
import struct
from collections.abc import Callable, Sequence
from pathlib import Path

from companion.recording.background_file import BackgroundFile

TLOG_FILE = "flight.tlog"
"""Name of the log in the folder of a flight."""
_MAX_WAITING_FRAMES = 20_000
"""Largest number of frames that wait to be written."""
_STAMP = struct.Struct(">Q")

TimedFrame = tuple[float, bytes]
"""Time when the frame was seen, s on the flight's clock, and the frame."""


class TlogWriter(BackgroundFile[TimedFrame]):
    """Writes frames to a file; it never delays the flight or raises an exception in it.

    Args:
        path: file that `open` creates.
        clock_epoch: unix time at which the flight's clock read 0, s; 0 if that clock is the
            vehicle's.
        on_failure: see `BackgroundFile`.
    """

    def __init__(
        self, path: Path, clock_epoch: float, on_failure: Callable[[str], None] | None = None
    ) -> None:
        super().__init__(path, _MAX_WAITING_FRAMES, on_failure)
        self._clock_epoch = clock_epoch

    def __call__(self, time: float, frame: bytes) -> None:
        """Take a frame that was seen at `time`, s on the flight's clock."""
        self.put((time, frame))

    def _create(self) -> None:
        self._file = self.path.open("wb", buffering=1 << 16)

    def _write(self, items: Sequence[TimedFrame]) -> None:
        clock_epoch, write = self._clock_epoch, self._file.write
        for time, frame in items:
            write(_STAMP.pack(round((clock_epoch + time) * 1e6)) + frame)
        self._file.flush()

    def _sync(self) -> None:
        os.fsync(self._file.fileno())

    def _finish_file(self, *, complete: bool) -> None:
        self._file.close()
