"""One client's channel: the queue of frames to it, and the scanner of frames from it."""

import ipaddress
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

from companion.mavlink.framing import Frame, FrameScanner

_MAX_QUEUED_BYTES = 32_768
"""Largest number of bytes queued for one client."""


@dataclass
class ClientStats:
    """Counters of one client."""

    received: int = 0
    """Intact frames from the client."""
    sent: int = 0
    """Frames passed to the kernel."""
    dropped: int = 0
    """Frames not sent, because the client or its connection is too slow."""
    flooded: int = 0
    """Datagrams of the client that were not read, because it sent too many."""


class ClientListener(Protocol):
    """The network, as the endpoints call it when clients connect, send frames and go."""

    def attach(self, client: "Client") -> None:
        """Add a client that has connected."""

    def detach(self, client: "Client") -> None:
        """Remove a client that has gone."""

    def receive_frames(self, client: "Client", frames: Iterable[Frame]) -> None:
        """Take the frames that a client has sent."""


class Client(ABC):
    """A client's channel: queues frames until `flush`; may drop whole frames, never parts.

    Args:
        name: name for messages, such as `udp 127.0.0.1:14550`.
        host: IP address of the client, or None.
        device: serial device of the client, or None.
        streaming: whether a frame may continue in the bytes of the next `scan`.

    Attributes:
        name, host, device: see the arguments.
        stats: counters.
    """

    def __init__(
        self, name: str, *, host: str | None = None, device: str | None = None, streaming: bool
    ) -> None:
        self.name, self.host, self.device = name, host, device
        self.stats = ClientStats()
        self._scanner = FrameScanner(streaming=streaming, keep_unknown=True)
        self._queued_frames: deque[bytes] = deque()
        self._queued_bytes = 0

    @property
    def is_local(self) -> bool:
        """Whether the client's address is a loopback address: it runs on this computer."""
        return self.host is not None and ipaddress.ip_address(self.host).is_loopback

    def put(self, frame: bytes) -> None:
        """Queue one frame; drop it if the queue is full."""
        if self._queued_bytes + len(frame) > _MAX_QUEUED_BYTES:
            self.stats.dropped += 1
            return
        self._queued_frames.append(frame)
        self._queued_bytes += len(frame)

    def scan(self, data: bytes) -> list[Frame]:
        """The intact frames that these bytes complete."""
        frames = self._scanner.feed(data)
        self.stats.received += len(frames)
        return frames

    def flush(self) -> None:
        """Send as many queued frames as possible now, without blocking."""
        if self._queued_frames:
            self._flush()

    @abstractmethod
    def _flush(self) -> None:
        """Send queued frames without blocking; called only if some are queued."""

    def _dequeue(self, max_bytes: int) -> tuple[bytes, int]:
        """Remove whole frames from the queue: the first, and more up to `max_bytes` bytes together.

        Returns:
            The bytes of the frames, and the number of frames.
        """
        frames = [self._queued_frames.popleft()]
        size = len(frames[0])
        while self._queued_frames and size + len(self._queued_frames[0]) <= max_bytes:
            size += len(self._queued_frames[0])
            frames.append(self._queued_frames.popleft())
        self._queued_bytes -= size
        return b"".join(frames), len(frames)

    def _drop_queued_frames(self) -> None:
        self.stats.dropped += len(self._queued_frames)
        self._queued_frames.clear()
        self._queued_bytes = 0


class FloodDetector:
    """Detects a client that sends faster than any program needs to."""

    WINDOW = 0.02
    """Length of the window in which frames are counted, and of a pause in reading, s."""
    _MAX_COUNT = 64
    """Largest number of frames or datagrams in one window."""
    _BYTES_PER_COUNT = 64
    """Received bytes that count as one frame, because scanning noise for frames takes time, too."""

    def __init__(self) -> None:
        self._window_start = 0.0
        self._count = 0

    def count(self, frame_count: int, byte_count: int, now: float) -> bool:
        """Count received frames or datagrams; return whether this window contains too many.

        Args:
            frame_count: number of frames or datagrams.
            byte_count: number of bytes.
            now: event-loop time, s.
        """
        if now - self._window_start > self.WINDOW:
            self._window_start, self._count = now, 0
        self._count += max(frame_count, byte_count // self._BYTES_PER_COUNT)
        return self._count > self._MAX_COUNT

    def is_flood(self, now: float) -> bool:
        """Whether the window at `now`, s, already contains too many frames or datagrams."""
        return now - self._window_start <= self.WINDOW and self._count > self._MAX_COUNT
