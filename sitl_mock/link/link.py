"""One MAVLink link of the vehicle: telemetry streams, signing, queue of outgoing frames."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.link.framing import Framer, Message
from sitl_mock.link.signing import Signing

TEXT_BYTES = 50
"""Length of STATUSTEXT.text, bytes."""


class StreamSchedule(Protocol):
    """Decides when each telemetry message of a link is due; each autopilot has its own rules."""

    def set_interval(self, message_id: int, interval_us: float, now_us: int) -> str | None:
        """Set the interval of a message; 0 = the rate at boot, negative = never.

        Returns:
            the reason for a refusal, None if accepted.
        """

    def interval(self, message_id: int) -> int:
        """Return the interval of a message in us, -1 if it is not streamed."""

    def due(self, slot_us: int, status_published_us: int = 0) -> list[int]:
        """Return the ids of the messages due in the slot at ``slot_us``, and count them as sent.

        ``status_published_us``: vehicle time of PX4's last published status, for CURRENT_MODE.
        """


@dataclass(eq=False)
class Link:
    """One link, without its socket; `Exchange.take_outgoing` takes the frames that are queued."""

    name: str
    """``companion`` or ``gcs``."""
    _framer: Framer
    """Packs frames."""
    streams: StreamSchedule
    signing: Signing | None = None
    """Signs and verifies frames; None = no signing."""
    outbox: list[bytes] = field(default_factory=list, init=False)
    gcs_has_sent: bool = field(default=False, init=False)
    """Whether a heartbeat of a ground station arrived."""
    client_has_sent: bool = field(default=False, init=False)
    """Whether an accepted message of a client arrived."""
    tamper: Callable[[Message], None] | None = field(default=None, init=False)
    """Changes each message before it is packed (faults); None = no change."""

    def send(self, message: Message) -> None:
        """Queue a message."""
        if self.tamper is not None:
            self.tamper(message)
        self.outbox.append(self._framer.frame(message))

    def send_text(self, text: str, severity: int, text_id: int) -> None:
        """Queue a text, in as many STATUSTEXT as it needs.

        ``severity`` is MAV_SEVERITY, ``text_id`` joins the messages of one text.
        """
        data = text.encode()
        for number, start in enumerate(range(0, len(data), TEXT_BYTES)):
            chunk = data[start : start + TEXT_BYTES]
            self.send(dialect.MAVLink_statustext_message(severity, chunk, text_id, number))

    def send_raw(self, message_id: int, crc_extra: int, payload: bytes) -> None:
        """Queue a message that the dialect lacks, given as its payload."""
        self.outbox.append(self._framer.frame_raw(message_id, crc_extra, payload))

    def take_frames(self) -> list[bytes]:
        """Return the queued frames in order, signed, and clear the queue."""
        frames, self.outbox = self.outbox, []
        return [self.sign(frame) for frame in frames]

    def sign(self, frame: bytes) -> bytes:
        """Return the frame, signed if this link signs."""
        return frame if self.signing is None else self.signing.sign(frame)

    def accepts(self, message: Message) -> bool:
        """Whether the signature policy of this link accepts a received message."""
        return self.signing is None or self.signing.accepts(message)
