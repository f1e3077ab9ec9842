"""One end of a wire, whatever it is made of: UDP, TCP or a serial line."""

from typing import Protocol

MAX_BUNDLE = 1400
"""Bytes of frames joined in one datagram at most."""


class Endpoint(Protocol):
    """Bytes in and out, never blocking. What cannot leave at once is lost."""

    @property
    def where(self) -> str:
        """Where it is to be found, in words."""

    @property
    def heard(self) -> bool:
        """Whether anybody has spoken yet."""

    @property
    def connected(self) -> bool:
        """Whether somebody is there to hear; a wire that cannot know says yes."""

    @property
    def readable(self) -> list[int]:
        """The file descriptors to wait on."""

    def receive(self) -> tuple[bytes, bool] | None:
        """Return the next datagram (a wire of bytes: the next frame), None if there is none.

        With it comes whether the one who is also sent to has sent it.
        """

    def send(self, datagrams: list[bytes]) -> None:
        """Send; what the network refuses is lost, as on any bad link."""

    def close(self) -> None:
        """Let go of the wire."""


def bundles(frames: list[bytes]) -> list[bytes]:
    """Return the frames joined, in their order, into datagrams that a network carries whole."""
    joined: list[bytes] = []
    size = 0
    start = 0
    for index, frame in enumerate(frames):
        if size + len(frame) > MAX_BUNDLE:
            joined.append(b"".join(frames[start:index]))
            start, size = index, 0
        size += len(frame)
    if size:
        joined.append(b"".join(frames[start:]))
    return joined
