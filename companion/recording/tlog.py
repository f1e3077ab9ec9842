"""The flight's MAVLink, both directions, as a `.tlog`: MAVProxy, QGroundControl and others read it.

A record is the time in microseconds since 1970, 8 bytes big endian, then the frame as it was on the
wire. Writing happens in a thread of its own, which looks every 50 ms for what the control loop has
appended: to wake it for each frame would cost the loop more than all the rest of recording.
"""

import struct
import threading
from collections import deque
from collections.abc import Callable
from pathlib import Path
from types import TracebackType

_MOST_WAITING = 20_000
_PERIOD = 0.05
_STAMP = struct.Struct(">Q")


class TlogWriter:
    """Writes frames to a file; never delays, never raises in the middle of a flight.

    Attributes:
        path: where it writes.
        dropped: frames that were not written because too many waited or the disk was full.
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
        self._waiting: deque[tuple[float, bytes]] = deque()
        self._closing = threading.Event()
        self._file = path.open("wb", buffering=1 << 16)
        self._thread = threading.Thread(target=self._write, name="tlog", daemon=True)
        self._thread.start()

    def __call__(self, time: float, frame: bytes) -> None:
        """Take one frame, seen at `time` on the flight's clock (s)."""
        if len(self._waiting) < _MOST_WAITING:
            self._waiting.append((time, frame))
        else:
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
        """Write out what waits and close the file."""
        self._closing.set()
        self._thread.join()

    def _write(self) -> None:
        while not self._closing.wait(_PERIOD):
            self._write_waiting()
        self._write_waiting()
        try:
            self._file.close()
        except OSError as error:
            self._fail(error)

    def _write_waiting(self) -> None:
        records = [self._waiting.popleft() for _ in range(len(self._waiting))]
        if self.failure is not None:
            self.dropped += len(records)
            return
        try:
            for time, frame in records:
                self._file.write(_STAMP.pack(round((self._epoch + time) * 1e6)) + frame)
            self._file.flush()
        except OSError as error:
            self.dropped += len(records)
            self._fail(error)

    def _fail(self, error: OSError) -> None:
        if self.failure is None:
            self.failure = f"{self.path}: recording stopped: {error.strerror}"
            if self._on_failure is not None:
                self._on_failure(self.failure)
