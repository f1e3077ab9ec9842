"""The interface of an endpoint: UDP, TCP or serial."""

from typing import Protocol

MAX_BUNDLE = 1400
"""Largest datagram into which frames are joined, bytes."""


class Endpoint(Protocol):
    """Sends and receives bytes without blocking. Frames that cannot be sent at once are dropped.

    If the kernel takes only a part of a batch, a byte stream keeps the rest.
    """

    @property
    def address(self) -> str:
        """Address of the endpoint, as text for the user."""

    @property
    def has_received(self) -> bool:
        """Whether anything was received yet."""

    @property
    def connected(self) -> bool:
        """Whether a client is connected; True where that cannot be known."""

    @property
    def descriptors(self) -> list[int]:
        """File descriptors for select."""

    def receive(self) -> tuple[bytes, bool] | None:
        """Return the next datagram (of a byte stream: the next frame), None if there is none.

        The flag tells whether the bytes came from the client to which the endpoint sends.
        """

    def send(self, datagrams: list[bytes]) -> None:
        """Send datagrams; those that the kernel refuses are dropped."""

    def close(self) -> None:
        """Close the endpoint."""


def joined_datagrams(frames: list[bytes]) -> list[bytes]:
    """Return the frames joined in order into datagrams of at most `MAX_BUNDLE` bytes."""
    datagrams: list[bytes] = []
    size = 0
    start = 0
    for index, frame in enumerate(frames):
        if size + len(frame) > MAX_BUNDLE:
            datagrams.append(b"".join(frames[start:index]))
            start, size = index, 0
        size += len(frame)
    if size:
        datagrams.append(b"".join(frames[start:]))
    return datagrams
