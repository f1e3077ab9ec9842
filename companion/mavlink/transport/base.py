"""The Protocol of a transport: bytes in, whole frames out, and no queue in between."""

from collections.abc import Callable
from typing import Protocol

Receive = Callable[[bytes, int], bool]
"""Takes bytes and the `perf_counter_ns` of their arrival; true if a frame in them was accepted."""


class Receiver(Protocol):
    """What a transport hands its bytes to. `PeerRule` says what a claim is."""

    def connect(self, *, streaming: bool) -> None:
        """Forget a frame that has begun: what comes next is of another connection."""

    def receive(self, data: bytes, received_ns: int) -> bool:
        """Take bytes of the peer (`Receive`)."""

    def claim(self, data: bytes, received_ns: int, who: str) -> bool:
        """Take bytes of `who`, who is not the peer; true if that makes it the peer.

        Without a valid claim in them nothing is accepted.
        """

    def may_answer(self, who: str) -> bool:
        """Whether `who`, whose claim failed, still receives what we send.

        Its frames are refused, but its answer may prove that it is no recording.
        """

    def claim_lapsed(self) -> bool:
        """Whether the peer's claim is so old that another sender may take its place."""

    def stranger(self, who: str) -> None:
        """Bytes of `who`, which is not among the peers that the endpoint names, were ignored."""


Lost = Callable[[str], None]
"""Takes the reason why the connection is gone."""

Tap = Callable[[float, bytes], None]
"""Takes the loop's time in s and one whole frame, received or sent. It must be quick."""

OPEN_TIMEOUT_S = 5.0
"""How long a TCP connection may take to come up."""


class Transport(Protocol):
    """One open connection. A dropped one is never reused: the link opens a fresh one."""

    @property
    def reconnects(self) -> bool:
        """True when a lost connection is to be opened again."""

    def send(self, frame: bytes) -> bool:
        """Hand one whole frame to the kernel now, or not at all.

        Returns:
            False if it could not leave: no peer yet, the kernel's buffer full, no route. Such a
            frame is gone; an old setpoint is worse than none.
        """

    def close(self) -> None:
        """Close at once; what the kernel has not taken is discarded."""
