"""One MAVLink link of the vehicle: its streams, what was heard on it, what waits to be sent."""

from collections.abc import Callable

from sitl_mock.link.framing import Framer, Message
from sitl_mock.link.signing import Signing
from sitl_mock.link.streams import StreamSchedule


class Link:
    """One link. The server empties ``outbox`` and owns the socket; here are only frames.

    Args:
        name: for logs and faults, e.g. ``companion`` or ``gcs``.
        framer: packs this link's frames.
        streams: this link's telemetry.
        signing: signs and judges this link's frames; None = nothing is signed or asked to be.
    """

    def __init__(
        self, name: str, framer: Framer, streams: StreamSchedule, signing: Signing | None = None
    ) -> None:
        self.name = name
        self.signing = signing
        self.streams = streams
        self.outbox: list[bytes] = []
        self.gcs_heard = False
        self.heard = False
        self.tamper: Callable[[Message], None] | None = None
        self._framer = framer

    def send(self, message: Message) -> None:
        """Queue a message."""
        if self.tamper is not None:
            self.tamper(message)
        self.outbox.append(self._framer.frame(message))

    def send_raw(self, message_id: int, crc_extra: int, payload: bytes) -> None:
        """Queue a message that the dialect module lacks, by its wire payload."""
        self.outbox.append(self._framer.frame_raw(message_id, crc_extra, payload))

    def take(self) -> list[bytes]:
        """Return the frames that wait, in order, signed as they leave, and forget them."""
        frames, self.outbox = self.outbox, []
        return [self.sign(frame) for frame in frames]

    def sign(self, frame: bytes) -> bytes:
        """Return a frame as it leaves on this link."""
        return frame if self.signing is None else self.signing.sign(frame)

    def admits(self, message: Message) -> bool:
        """Whether a message that arrived here may be obeyed."""
        return self.signing is None or self.signing.admits(message)
