"""Counters of a link, and the tracking of sequence numbers."""

from dataclasses import dataclass, field

TOLERABLE_LOSS = 0.02
"""Share of frames that may be lost without consequences for a flight."""


def share_lost(frames: int, lost: int) -> float:
    """Share of the sent frames that were lost, from the numbers received and lost."""
    return lost / max(1, lost + frames)


@dataclass
class LinkStats:
    """Counters of one link."""

    frames: int = 0
    """Frames accepted from the vehicle."""
    lost: int = 0
    """Frames missing in the vehicle's sequence numbers."""
    repeated: int = 0
    """Frames received twice or late."""
    bad_crc: int = 0
    """Frames with a wrong checksum."""
    unknown: int = 0
    """Frames of messages that the dialect does not know."""
    bad_signature: int = 0
    """Frames unsigned, wrongly signed, replayed or dated too far ahead, while signing is on."""
    ignored_foreign: int = 0
    """Frames of other systems or components than the vehicle's."""
    unclaimed: int = 0
    """Frames with the vehicle's ids, from a sender that is not the peer (`PeerRule`)."""
    non_finite: int = 0
    """Messages refused for a NaN or infinity."""
    non_finite_at: dict[str, float] = field(default_factory=dict)
    """Event-loop time of the newest message refused for a NaN or infinity, s, by message name."""
    outdated: int = 0
    """Position messages refused because one with the same or a later time stamp had come."""
    stamped_ahead: int = 0
    """Position messages refused because their time stamp was ahead of the vehicle's clock."""
    malformed: int = 0
    """Messages that could not be decoded or whose values are impossible."""
    sent: int = 0
    """Frames of this program that were passed to the kernel."""
    forwarded: int = 0
    """Frames of other nodes that were passed to the kernel unchanged."""
    not_sent: int = 0
    """Frames of this program dropped because they could not be sent (no peer, buffer full,
    connection down)."""
    reconnects: int = 0
    """Number of times that the connection was opened again, or a TCP server lost its client."""
    peers: int = 0
    """Number of times that the peer changed to another address or port, or another TCP client. A
    peer that returns at the same address and port does not count. A serial port or TCP connection
    that this program opens again counts only in `reconnects`."""
    by_message: dict[int, int] = field(default_factory=dict)
    """Accepted frames for each message id."""
    foreign_sources: set[tuple[int, int]] = field(default_factory=set)
    """(system, component) of the frames in `ignored_foreign`."""

    def refuse_non_finite(self, message: str, now: float) -> None:
        """Count, by its name, a message with a NaN or infinity; `now`: event-loop time, s."""
        self.non_finite += 1
        self.non_finite_at[message] = now


class FrameCounter:
    """Counts accepted frames, and the gaps in their sequence numbers (0..255, wrapping)."""

    def __init__(self, stats: LinkStats) -> None:
        self._stats = stats
        self._last_sequence: int | None = None
        self._counted_unknown = 0

    def count(self, message_id: int, sequence: int) -> None:
        """Count one accepted frame."""
        stats = self._stats
        missing_count = self._missing_count(sequence)
        if missing_count < 0:
            stats.repeated += 1
        elif missing_count:
            # A frame of an unknown message has a sequence number too. It came, so it is not lost.
            unknown_count = min(missing_count, stats.unknown - self._counted_unknown)
            self._counted_unknown += unknown_count
            stats.lost += missing_count - unknown_count
        stats.frames += 1
        stats.by_message[message_id] = stats.by_message.get(message_id, 0) + 1

    def reset(self) -> None:
        """Forget the last sequence number after a reconnect, so that no gap is counted."""
        self._last_sequence = None

    def _missing_count(self, sequence: int) -> int:
        """Number of frames missing before the frame with the number `sequence`.

        −1 if that frame is repeated, or late by up to 127 frames.
        """
        sequence_step = (
            1 if self._last_sequence is None else (sequence - self._last_sequence) & 0xFF
        )
        if sequence_step == 0 or sequence_step > 128:
            return -1
        self._last_sequence = sequence
        return sequence_step - 1
