"""Clients for `companion bench serve`: they read all forwarded frames, and count the lost ones.

`python -m companion.bench.client_program PORT COUNT` runs COUNT clients until its standard input is
closed, and then prints how many frames each received and lost, as a line of JSON.
"""

import json
import selectors
import socket
import sys
import time
from contextlib import suppress

from pymavlink.dialects.v20 import common as dialect

_HEARTBEAT_PERIOD_S = 0.5
_READ_BYTES = 65_536
_RECEIVE_BUFFER_BYTES = 1 << 20
_HEADER_BYTES, _OVERHEAD_BYTES = 10, 12
_MAGIC, _LENGTH_OFFSET, _SEQUENCE_OFFSET, _SYSTEM_OFFSET, _COMPONENT_OFFSET = 0xFD, 1, 4, 5, 6
_AUTOPILOT_IDS = 1, 1
"""System id and component id of the autopilot."""


class FrameCounter:
    """Counts the autopilot's frames on one socket, and the gaps in their sequence numbers.

    Attributes:
        received: number of frames received.
        lost: number of frames missing in the gaps.
    """

    def __init__(self) -> None:
        self.received = self.lost = 0
        self._sequence: int | None = None

    def count_frames(self, datagram: bytes) -> None:
        """Count the frames of a datagram; they must be whole, unsigned MAVLink 2 frames."""
        start = 0
        while start + _HEADER_BYTES <= len(datagram) and datagram[start] == _MAGIC:
            if (
                datagram[start + _SYSTEM_OFFSET],
                datagram[start + _COMPONENT_OFFSET],
            ) == _AUTOPILOT_IDS:
                self._count_frame(datagram[start + _SEQUENCE_OFFSET])
            start += _OVERHEAD_BYTES + datagram[start + _LENGTH_OFFSET]

    def _count_frame(self, sequence: int) -> None:
        if self._sequence is not None:
            self.lost += (sequence - self._sequence - 1) & 0xFF
        self._sequence = sequence
        self.received += 1


def main(port: int, count: int) -> None:
    """Run `count` clients on UDP port `port` until standard input is closed; print their counts."""
    heartbeat = dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
    selector = selectors.DefaultSelector()
    selector.register(sys.stdin, selectors.EVENT_READ, None)
    sockets = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(count)]
    counters = [FrameCounter() for _ in sockets]
    senders = [dialect.MAVLink(None, 200 + number, 190) for number in range(count)]
    for client, counter in zip(sockets, counters, strict=True):
        client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _RECEIVE_BUFFER_BYTES)
        client.connect(("127.0.0.1", port))
        selector.register(client, selectors.EVENT_READ, counter)
    heartbeat_due = 0.0
    while True:
        if time.monotonic() >= heartbeat_due:
            heartbeat_due = time.monotonic() + _HEARTBEAT_PERIOD_S
            for client, sender in zip(sockets, senders, strict=True):
                client.send(heartbeat.pack(sender))
                sender.seq = (sender.seq + 1) & 0xFF
        for key, _ in selector.select(_HEARTBEAT_PERIOD_S):
            if key.data is None:
                counts = [
                    {"received": counter.received, "lost": counter.lost} for counter in counters
                ]
                with suppress(BrokenPipeError):  # the benchmark was ended
                    print(json.dumps(counts), flush=True)
                return
            key.data.count_frames(key.fileobj.recv(_READ_BYTES))  # type: ignore[union-attr]


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
