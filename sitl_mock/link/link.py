"""One MAVLink link of the vehicle: its streams, what was heard on it, what waits to be sent."""

from collections.abc import Callable
from typing import Protocol

from sitl_mock.link.framing import Framer, Message
from sitl_mock.link.signing import Signing


class StreamSchedule(Protocol):
    """The streams of one link."""

    def set_interval(self, message_id: int, interval_us: float, now_us: int) -> str | None:
        """Ask for a message every ``interval_us``; 0 = the rate at boot, negative = never.

        Returns:
            why it is refused, in words; None: it is not.
        """

    def interval(self, message_id: int) -> int:
        """Return the interval in us that is set for a message, -1 if it is not streamed."""

    def due(self, slot_us: int, status_us: int = 0) -> list[int]:
        """Return the ids of the messages to send in the slot at ``slot_us``; they count as sent."""


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

    def accepts(self, message: Message) -> bool:
        """Whether a message that arrived here may be obeyed."""
        return self.signing is None or self.signing.accepts(message)
