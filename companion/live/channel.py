"""The channels between a flight and its helper process: whole messages, never blocking."""

import json
import socket
import sys
from collections.abc import Iterator
from typing import Any

_LARGEST_MESSAGE = 200_000
"""Largest message, bytes; the system's buffer holds at least one of this size."""

Message = dict[str, Any]


class Channel:
    """One end of a channel. Messages that the other end does not read in time are dropped.

    Attributes:
        dropped: number of messages that could not be sent, because the buffer was full, the message
            too large, or the other end closed. After the other end has closed, only the first
            message is counted.
        is_open: whether the other end was still open when a message was last sent.
    """

    def __init__(self, our_socket: socket.socket) -> None:
        self.dropped = 0
        self.is_open = True
        self._socket = our_socket

    @staticmethod
    def pair() -> "tuple[Channel, socket.socket]":
        """Make a channel; return this process's end, and the socket for the other process."""
        our_socket, other_socket = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        our_socket.setblocking(False)
        return Channel(our_socket), other_socket

    def fileno(self) -> int:
        """File descriptor, for `add_reader`."""
        return self._socket.fileno()

    def send(self, message: Message) -> bool:
        """Send a message or drop it; return whether it was sent."""
        if not self.is_open:
            return False
        data = json.dumps(message, default=str).encode()
        try:
            if len(data) <= _LARGEST_MESSAGE:  # else the other end would receive only the beginning
                self._socket.send(data, socket.MSG_DONTWAIT)
                return True
        except BlockingIOError:
            pass
        except OSError:  # the other end is gone
            self.is_open = False
        self.dropped += 1
        return False

    def received_messages(self, max_count: int = sys.maxsize) -> Iterator[Message | None]:
        """Yield up to `max_count` received messages, and None if the other end is closed.

        With a blocking socket, wait for each message.
        """
        for data in datagrams(self._socket, max_count):
            if not data:
                self.is_open = False
                yield None
                return
            message = json.loads(data)
            yield message if isinstance(message, dict) else {}

    def close(self) -> None:
        """Close this process's end."""
        self.is_open = False
        self._socket.close()


class Feed:
    """Sends records of the flight to the helper process. Its methods may run in any thread.

    Attributes:
        dropped: number of datagrams that were not sent: the buffer was full, or the process had
            ended.
    """

    def __init__(self, our_socket: socket.socket) -> None:
        self.dropped = 0
        self._socket = our_socket

    @staticmethod
    def pair() -> "tuple[Feed, socket.socket]":
        """Make a feed; return this process's end, and the socket for the other process."""
        our_socket, other_socket = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        return Feed(our_socket), other_socket

    def send(self, datagram: bytes) -> None:
        """Send a datagram, or drop it."""
        try:
            self._socket.send(datagram, socket.MSG_DONTWAIT | socket.MSG_NOSIGNAL)
        except OSError:  # the buffer is full, or the process is gone
            self.dropped += 1

    def close(self) -> None:
        """Close this process's end."""
        self._socket.close()


def datagrams(our_socket: socket.socket, max_count: int) -> Iterator[bytes]:
    """Yield at most `max_count` arrived datagrams, and b"" if the other end was closed."""
    for _ in range(max_count):
        try:
            datagram = our_socket.recv(_LARGEST_MESSAGE)
        except BlockingIOError:
            return
        except OSError:
            datagram = b""
        yield datagram
        if not datagram:
            return


class NoAnswerError(Exception):
    """The flight did not answer a request in time; the message is a sentence for the user."""
