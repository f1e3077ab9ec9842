"""Clients of the benchmark: they read all that is passed on, and count what is missing.

`python -m companion.bench.client_program PORT COUNT` ends with a line of JSON when its standard
input is closed.
"""

import json
import selectors
import socket
import sys
import time
from contextlib import suppress

from pymavlink.dialects.v20 import common as dialect

_BEAT_S = 0.5
_LARGEST_READ = 65_536
_RECEIVE_BUFFER = 1 << 20
_HEADER, _REST = 10, 12
_MAGIC, _LENGTH_AT, _SEQUENCE_AT, _SYSTEM_AT, _COMPONENT_AT = 0xFD, 1, 4, 5, 6
_AUTOPILOT = 1, 1


class Counter:
    """Counts the autopilot's frames on one socket, and the gaps in their sequence numbers.

    Attributes:
        received: frames.
        lost: frames missing by their sequence numbers.
    """

    def __init__(self) -> None:
        self.received = self.lost = 0
        self._sequence: int | None = None

    def take(self, datagram: bytes) -> None:
        """Count the frames of a datagram: whole, unsigned MAVLink 2 frames."""
        at = 0
        while at + _HEADER <= len(datagram) and datagram[at] == _MAGIC:
            if (datagram[at + _SYSTEM_AT], datagram[at + _COMPONENT_AT]) == _AUTOPILOT:
                self._count(datagram[at + _SEQUENCE_AT])
            at += _REST + datagram[at + _LENGTH_AT]

    def _count(self, sequence: int) -> None:
        if self._sequence is not None:
            self.lost += (sequence - self._sequence - 1) & 0xFF
        self._sequence = sequence
        self.received += 1


def main(port: int, count: int) -> None:
    """Read on `count` sockets until standard input is closed; print the counts."""
    beat = dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
    selector = selectors.DefaultSelector()
    selector.register(sys.stdin, selectors.EVENT_READ, None)
    sockets = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(count)]
    counters = [Counter() for _ in sockets]
    senders = [dialect.MAVLink(None, 200 + number, 190) for number in range(count)]
    for opened, counter in zip(sockets, counters, strict=True):
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _RECEIVE_BUFFER)
        opened.connect(("127.0.0.1", port))
        selector.register(opened, selectors.EVENT_READ, counter)
    due = 0.0
    while True:
        if time.monotonic() >= due:
            due = time.monotonic() + _BEAT_S
            for opened, sender in zip(sockets, senders, strict=True):
                opened.send(beat.pack(sender))
                sender.seq = (sender.seq + 1) & 0xFF
        for key, _ in selector.select(_BEAT_S):
            if key.data is None:
                counts = [{"received": each.received, "lost": each.lost} for each in counters]
                with suppress(BrokenPipeError):  # the benchmark was ended
                    print(json.dumps(counts), flush=True)
                return
            key.data.take(key.fileobj.recv(_LARGEST_READ))  # type: ignore[union-attr]


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
