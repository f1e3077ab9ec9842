"""Queues clients' frames to the vehicle; limits their rate, so that they do not delay setpoints."""

from collections import deque
from collections.abc import Callable

from companion.mavlink.transport.endpoint import Endpoint, SerialPort

_MAX_QUEUED_FRAMES = 64
"""Largest number of frames of one client that wait to be sent to the vehicle."""
_MAX_FRAME_AGE = 1.0
"""Largest age of a queued frame that is still sent, s: no old command to arm may arrive after an
outage."""
_LARGEST_FRAME = 280
_SERIAL_SHARE = 0.5
"""Share of a serial line that clients may use; our setpoints and requests need the rest."""
_BITS_PER_BYTE = 10
_NETWORK_BYTES_PER_S = 500_000.0
"""Largest rate of clients' bytes on a UDP or TCP link to the vehicle, bytes/s."""
_NETWORK_BURST_BYTES = 50_000.0


def uplink_limits(endpoint: Endpoint) -> tuple[float, float]:
    """Limits of clients' frames to the vehicle: (bytes per second, bytes sent at once)."""
    if isinstance(endpoint, SerialPort):
        rate = _SERIAL_SHARE * endpoint.baud / _BITS_PER_BYTE
        return rate, max(float(_LARGEST_FRAME), 0.01 * rate)
    return _NETWORK_BYTES_PER_S, _NETWORK_BURST_BYTES


class UplinkQueue:
    """Queues the frames of each client and sends them in turn, as fast as the link allows.

    Args:
        send: sends a whole frame now; returns false if it could not be sent.
        rate: largest mean rate, bytes/s.
        burst: largest number of bytes sent at once.
        clock: returns the event-loop time, s.

    Attributes:
        sent: number of frames sent.
        dropped: number of frames that were dropped, because their client's queue was full or they
            waited too long.
    """

    def __init__(
        self, send: Callable[[bytes], bool], rate: float, burst: float, clock: Callable[[], float]
    ) -> None:
        self.sent = self.dropped = 0
        self._send, self._rate, self._burst, self._clock = send, rate, burst, clock
        self._allowed_bytes, self._refilled_at = burst, clock()
        self._queues: dict[object, deque[tuple[float, bytes]]] = {}
        # Clients with queued frames, the next one first.
        self._client_turns: deque[object] = deque()

    def put(self, frame: bytes, origin: object) -> None:
        """Queue a frame of the client `origin`; drop it if that client has too many queued."""
        queue = self._queues.get(origin)
        if queue is None:
            queue = self._queues[origin] = deque()
            self._client_turns.append(origin)
        if len(queue) >= _MAX_QUEUED_FRAMES:
            self.dropped += 1
            return
        queue.append((self._clock(), frame))

    def drain(self) -> bool:
        """Send as many frames as allowed, one of each client in turn; return whether any remain."""
        now = self._clock()
        self._allowed_bytes = min(
            self._burst, self._allowed_bytes + self._rate * (now - self._refilled_at)
        )
        self._refilled_at = now
        while self._client_turns and self._allowed_bytes > 0.0:
            origin = self._client_turns[0]
            queue = self._queues[origin]
            queued_at, frame = queue[0]
            if now - queued_at > _MAX_FRAME_AGE:
                self.dropped += 1
            elif self._send(frame):
                self._allowed_bytes -= len(frame)
                self.sent += 1
            else:
                return True
            queue.popleft()
            self._client_turns.popleft()
            if queue:
                self._client_turns.append(origin)
            else:
                del self._queues[origin]
        return bool(self._client_turns)

    def forget(self, origin: object) -> None:
        """Drop the queued frames of a client that is gone."""
        if self._queues.pop(origin, None) is not None:
            self._client_turns.remove(origin)
