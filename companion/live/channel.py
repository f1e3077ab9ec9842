"""The channel between a flight and its helper process: whole messages, never blocking."""

import json
import socket
from collections.abc import Iterator
from math import inf
from typing import Any

_LARGEST = 200_000
"""Largest message, bytes; the system's buffer holds at least one."""

Message = dict[str, Any]


class Channel:
    """One end. Messages that the other end does not read in time are dropped and counted.

    Attributes:
        dropped: messages that were not sent because the buffer was full.
        open: whether the other end was there at the last attempt.

    Args:
        end: a non-blocking or blocking SEQPACKET socket.
    """

    def __init__(self, end: socket.socket) -> None:
        self.dropped = 0
        self.open = True
        self._end = end

    @staticmethod
    def pair() -> "tuple[Channel, socket.socket]":
        """Our end, and the socket for the other process."""
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        ours.setblocking(False)
        return Channel(ours), theirs

    def fileno(self) -> int:
        """For `add_reader`."""
        return self._end.fileno()

    def send(self, message: Message) -> bool:
        """Send a message, or drop it; returns whether it was sent."""
        if not self.open:
            return False
        data = json.dumps(message, default=str).encode()
        try:
            self._end.send(data, socket.MSG_DONTWAIT)
        except BlockingIOError:
            self.dropped += 1
            return False
        except OSError:  # gone, or larger than the buffer
            self.open = len(data) > _LARGEST
            self.dropped += 1
            return False
        return True

    def receive(self) -> Message | None:
        """The next message, or None if the other end is gone.

        Raises:
            BlockingIOError: the socket is non-blocking and no message waits.
        """
        try:
            data = self._end.recv(_LARGEST)
        except BlockingIOError:
            raise
        except OSError:
            data = b""
        if not data:
            self.open = False
            return None
        message = json.loads(data)
        return message if isinstance(message, dict) else {}

    def waiting(self, most: float = inf) -> Iterator[Message | None]:
        """The messages that wait now, at most `most` of them; a last None: the other end is gone.

        The socket must not block.
        """
        taken = 0
        while taken < most:
            taken += 1
            try:
                message = self.receive()
            except BlockingIOError:
                return
            yield message
            if message is None:
                return

    def close(self) -> None:
        """Close our end."""
        self.open = False
        self._end.close()


class NoAnswerError(Exception):
    """The flight has not answered a request in time; the message is a sentence for the user."""
