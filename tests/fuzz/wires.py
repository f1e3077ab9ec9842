"""A wire without sockets: what a link is given to read, and what it sends."""

from collections.abc import Callable
from typing import Any

from companion.mavlink.transport.base import Receiver


class Wire:
    """Opens as any transport does; `deliver` is what arrives on it.

    Args:
        take: is given each frame that the link sends.
    """

    reconnects = True

    def __init__(self, take: Callable[[bytes], None] = lambda _: None) -> None:
        self._take = take
        self._receiver: Receiver | None = None

    async def open(self, _endpoint: Any, receiver: Receiver, _lost: Any) -> "Wire":
        """Open it, as `companion.mavlink.transport.opening.open_transport` does."""
        self._receiver = receiver
        return self

    def deliver(self, data: bytes, received_ns: int = 0, who: str | None = None) -> bool:
        """Let bytes arrive, of the peer or of `who`: a datagram, or a piece of a stream."""
        assert self._receiver is not None
        if who is None:
            return self._receiver.receive(data, received_ns)
        return self._receiver.claim(data, received_ns, who)

    def send(self, frame: bytes) -> bool:
        """Take what the link sends."""
        self._take(frame)
        return True

    def close(self) -> None:
        """Nothing is open."""
