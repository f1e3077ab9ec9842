"""The interface of a transport: it receives bytes and sends whole frames, without a queue."""

import errno
from collections.abc import Callable
from typing import Protocol

ReceiveCallback = Callable[[bytes, int], bool]
"""Called with bytes and the `perf_counter_ns` of their arrival; returns whether a frame in them was
accepted.
"""


class Receiver(Protocol):
    """Takes the bytes that a transport receives. `PeerRule` explains claims."""

    def start_connection(self, *, streaming: bool) -> None:
        """Prepare for a new connection: forget an incomplete frame and the last sequence number.

        Args:
            streaming: whether a frame may continue in the bytes received next.
        """

    def receive(self, data: bytes, received_ns: int) -> bool:
        """Take bytes from the peer; return whether a frame was accepted (`ReceiveCallback`)."""

    def claim(self, data: bytes, received_ns: int, sender: str) -> bool:
        """Take bytes from `sender`, who is not the peer; return whether `sender` becomes the peer.

        If the bytes contain no valid claim, none of their frames is accepted.
        """

    def needs_timesync_with(self, sender: str) -> bool:
        """Whether to send frames to `sender`, although its claim was refused.

        True if the frame was signed with the right key, but only an answer to a TIMESYNC request
        can prove its time stamp (`Signing.needs_timesync_answer`). The next frame that is accepted
        then makes `sender` the peer.
        """

    def may_replace_peer(self) -> bool:
        """Whether the peer's claim is so old that another sender may become the peer."""

    def report_ignored(self, sender: str) -> None:
        """Tell the user that `sender` was ignored, because the endpoint names only other peers."""


LostCallback = Callable[[str], None]
"""Called with the reason when the connection is lost."""

Tap = Callable[[float, bytes], None]
"""Called with the event-loop time (s) and one whole frame, received or sent; must be quick."""

OPEN_TIMEOUT_S = 5.0
"""Time allowed to open a TCP connection, s."""

_REMEDIES = {
    errno.EADDRINUSE: "the port is in use by another program (another companion, a ground "
    "station?) or an open connection of this one; end it or choose another port",
    errno.EACCES: "not permitted; use a port of 1024 or above",
    errno.EPERM: "not permitted; use a port of 1024 or above",
    errno.EADDRNOTAVAIL: "no interface of this computer has that address; use 0.0.0.0",
}


def why_not_opened(error: OSError) -> str:
    """Why the system refused to open a UDP or TCP port, and if possible what to do."""
    return _REMEDIES.get(error.errno or 0) or error.strerror or str(error)


class Transport(Protocol):
    """One open connection. A lost connection is not used again: the link opens a new one."""

    @property
    def reconnects(self) -> bool:
        """Whether the link must open a new connection after this one is lost."""

    def send(self, frame: bytes) -> bool:
        """Pass one whole frame to the kernel now, or not at all.

        Returns:
            False if the frame could not be sent: no peer yet, the kernel's buffer full, no route.
            Such a frame is dropped: an old setpoint is worse than none.
        """

    def close(self) -> None:
        """Close at once; bytes that the kernel has not taken are discarded."""
