"""Which client controls the vehicle: one at a time, until it releases control or is silent."""

from collections.abc import Hashable
from dataclasses import dataclass
from enum import Enum
from math import inf

_MAX_CLIENTS = 64
"""Largest number of remembered clients; if more send setpoints, silent clients are forgotten."""


class ControlState(Enum):
    """State of the control by the owner, the client in control."""

    FREE = "no client is in control"
    LIVE = "the owner's setpoints are flown"
    HOLDING = "the owner is silent, and the vehicle is held"
    EXPIRED = "the owner was silent for too long, and the vehicle is handed back"


@dataclass
class _Stream:
    """Arrival times of the last two setpoints of one client."""

    newest_arrival: float = -inf
    """Event-loop time at which the newest setpoint arrived, s; −inf: none yet."""
    previous_arrival: float = -inf
    """Event-loop time at which the setpoint before the newest arrived, s; −inf: none yet."""


class Ownership:
    """Keeps one owner, the client in control, and refuses all others with a reason.

    Args:
        timeout: time without a setpoint after which a client counts as silent, s.
        hold_time: time for which the vehicle is held for a silent owner, s.

    Attributes:
        owner: the client in control, or None.
    """

    def __init__(self, timeout: float, hold_time: float) -> None:
        self._timeout, self._hold_time = timeout, hold_time
        self.owner: Hashable | None = None
        self._streams: dict[Hashable, _Stream] = {}

    def note_setpoint(self, client: Hashable, now: float) -> str | None:
        """Note a setpoint; return why it is not flown, or None.

        A setpoint of another client takes over from a silent owner.
        """
        owner = self.owner
        if owner is not None and client != owner:
            if self._is_live(owner, now):
                return f"{owner} is in control"
            self.owner = client
        stream = self._streams.setdefault(client, _Stream())
        stream.previous_arrival, stream.newest_arrival = stream.newest_arrival, now
        if len(self._streams) > _MAX_CLIENTS:
            self._forget_silent(now)
        return None

    def withdraw(self, client: Hashable, owner_before: Hashable | None) -> None:
        """Withdraw the setpoint that was noted last, because it cannot be flown.

        `owner_before` was in control before the setpoint.
        """
        self.owner = owner_before
        stream = self._streams[client]
        stream.newest_arrival = stream.previous_arrival

    def request_control(self, client: Hashable, now: float) -> str | None:
        """Give control to a client that requests it; return the reason of a refusal, or None."""
        owner = self.owner
        if owner is not None and owner != client and self._is_live(owner, now):
            return f"{owner} is in control"
        if not self._is_live(client, now):
            return f"send setpoints first, every {1e3 * self._timeout:.0f} ms or more often"
        self.owner = client
        return None

    def has_stream(self, client: Hashable, now: float) -> bool:
        """Whether a client sends a stream: its last two setpoints came within the timeout."""
        stream = self._streams.get(client, _Stream())
        return (
            self._is_live(client, now)
            and stream.newest_arrival - stream.previous_arrival <= self._timeout
        )

    def begin(self, now: float) -> None:
        """Note that control begins; if the owner is already silent, its hold time starts now."""
        stream = self._streams.setdefault(self.owner, _Stream())
        stream.newest_arrival = max(stream.newest_arrival, now - self._timeout)

    def release(self) -> None:
        """End the ownership: the owner has released control, or the vehicle has left our mode."""
        self.owner = None

    def state(self, now: float) -> ControlState:
        """State of the control at the event-loop time `now`, s."""
        if self.owner is None:
            return ControlState.FREE
        overdue = now - self._streams.get(self.owner, _Stream()).newest_arrival - self._timeout
        if overdue <= 0.0:
            return ControlState.LIVE
        return ControlState.HOLDING if overdue <= self._hold_time else ControlState.EXPIRED

    def _is_live(self, client: Hashable, now: float) -> bool:
        return now - self._streams.get(client, _Stream()).newest_arrival <= self._timeout

    def _forget_silent(self, now: float) -> None:
        self._streams = {
            client: stream
            for client, stream in self._streams.items()
            if client == self.owner or self._is_live(client, now)
        }
