"""A wire without sockets: what a link is given to read, and what it sends."""

from collections.abc import Callable
from typing import Any

_Receive = Callable[[bytes, int], Any]


class Wire:
    """Opens as any transport does; `deliver` is what arrives on it.

    Args:
        take: is given each frame that the link sends.
    """

    reconnects = True

    def __init__(self, take: Callable[[bytes], None] = lambda _: None) -> None:
        self._take = take
        self._receive: _Receive | None = None

    async def open(self, _endpoint: Any, receive: _Receive, _lost: Any) -> "Wire":
        """Open it, as `companion.mavlink.opening.open_transport` does."""
        self._receive = receive
        return self

    def deliver(self, data: bytes, received_ns: int = 0) -> Any:
        """Let bytes arrive: one datagram, or a piece of a stream."""
        assert self._receive is not None
        return self._receive(data, received_ns)

    def send(self, frame: bytes) -> bool:
        """Take what the link sends."""
        self._take(frame)
        return True

    def close(self) -> None:
        """Nothing is open."""
