"""MAVLink frames over a byte stream: a TCP connection or a serial line."""

import os
from collections import deque
from dataclasses import dataclass, field

from sitl_mock.link.framing import split_frames

_READ_BYTES = 65536


@dataclass(eq=False)
class ByteStream:
    """Reads and writes whole frames without blocking.

    Frames are never truncated: if the kernel takes only a part of a batch, the rest is kept and
    written first. Until the rest is written, further frames are dropped, as by an autopilot whose
    transmit buffer is full.
    """

    _descriptor: int
    """A non-blocking file descriptor; the caller closes it."""
    open: bool = field(default=True, init=False)
    """False after the other side closed, or reading or writing failed."""
    _frames: deque[bytes] = field(default_factory=deque, init=False)
    _partial_frame: bytes = field(default=b"", init=False)
    _unsent_bytes: bytes = field(default=b"", init=False)

    def receive(self) -> bytes | None:
        """Return the next complete frame, None if there is none yet."""
        if not self._frames:
            self._read()
        return self._frames.popleft() if self._frames else None

    def send(self, frames: list[bytes]) -> None:
        """Send the frames; drop them all if the kernel takes none of their bytes now.

        The frames are also dropped while an earlier batch is not completely written.
        """
        if self._unsent_bytes:
            self._unsent_bytes = self._unsent_bytes[self._write(self._unsent_bytes) :]
        if not self._unsent_bytes:
            data = b"".join(frames)
            written = self._write(data)
            self._unsent_bytes = data[written:] if written else b""

    def _read(self) -> None:
        try:
            data = os.read(self._descriptor, _READ_BYTES)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self.open = False
            return
        frames, self._partial_frame = split_frames(self._partial_frame + data)
        self._frames.extend(frames)

    def _write(self, data: bytes) -> int:
        try:
            return os.write(self._descriptor, data) if data else 0
        except BlockingIOError:
            return 0
        except OSError:
            self.open = False
            return 0
