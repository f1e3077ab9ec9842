"""The flight's MAVLink, both directions, as a `.tlog`: MAVProxy, QGroundControl and others read it.

A record is the time in microseconds since 1970, 8 bytes big endian, then the frame as it was on the
wire. Writing happens in a thread of its own behind a bounded queue: the control loop only appends.
"""

import queue
import struct
import threading
from collections.abc import Callable
from pathlib import Path
from types import TracebackType

_QUEUE_LENGTH = 20_000
_STAMP = struct.Struct(">Q")


class TlogWriter:
    """Writes frames to a file; never delays, never raises in the middle of a flight.

    Attributes:
        path: where it writes.
        dropped: frames that found the queue full.
        failure: why writing ended early (a full disk, say), or None.

    Args:
        path: file to create.
        epoch: seconds since 1970 at which the flight's clock read zero.
        on_failure: called once, from the writing thread, when the file cannot be written any more.

    Raises:
        OSError: the file cannot be created.
    """

    def __init__(
        self, path: Path, epoch: float, on_failure: Callable[[str], None] | None = None
    ) -> None:
        self.path = path
        self.dropped = 0
        self.failure: str | None = None
        self._epoch = epoch
        self._on_failure = on_failure
        self._queue: queue.Queue[tuple[float, bytes] | None] = queue.Queue(_QUEUE_LENGTH)
        self._file = path.open("wb", buffering=1 << 16)
        self._thread = threading.Thread(target=self._write, name="tlog", daemon=True)
        self._thread.start()

    def __call__(self, time: float, frame: bytes) -> None:
        """Take one frame, seen at `time` on the flight's clock (s)."""
        try:
            self._queue.put_nowait((time, frame))
        except queue.Full:
            self.dropped += 1

    def __enter__(self) -> "TlogWriter":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Write out what is queued and close the file."""
        self._queue.put(None)
        self._thread.join()

    def _write(self) -> None:
        while (record := self._queue.get()) is not None:
            if self.failure is not None:
                self.dropped += 1
                continue
            time, frame = record
            try:
                self._file.write(_STAMP.pack(round((self._epoch + time) * 1e6)) + frame)
                if self._queue.empty():
                    self._file.flush()
            except OSError as error:
                self._fail(error)
        try:
            self._file.close()
        except OSError as error:
            self._fail(error)

    def _fail(self, error: OSError) -> None:
        if self.failure is None:
            self.failure = f"{self.path}: recording stopped: {error.strerror}"
            if self._on_failure is not None:
                self._on_failure(self.failure)
