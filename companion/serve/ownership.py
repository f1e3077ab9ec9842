"""Which client controls the vehicle: one at a time, until it releases control or is silent."""

from collections.abc import Hashable
from dataclasses import dataclass
from enum import Enum
from math import inf

_MAX_CLIENTS = 64
"""Number of remembered clients above which the silent ones are forgotten."""


class ControlState(Enum):
    """What the vehicle does for its owner, the client in control."""

    FREE = "no client is in control"
    LIVE = "the owner's setpoints are flown"
    HOLDING = "the owner is silent, and the vehicle is held"
    EXPIRED = "the owner was silent for too long, and the vehicle is handed back"


@dataclass
class _Stream:
    """The setpoints of one client."""

    newest: float = -inf
    """Arrival of the newest setpoint, s."""
    previous: float = -inf
    """Arrival of the setpoint before the newest, s."""


class Ownership:
    """Keeps one owner, the client in control, and refuses all others with a reason.

    Args:
        timeout: a client without a setpoint for this long is silent, s.
        hold: time for which the vehicle is held for a silent owner, s.

    Attributes:
        owner: the client in control, or None.
    """

    def __init__(self, timeout: float, hold: float) -> None:
        self._timeout, self._hold = timeout, hold
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
        stream.previous, stream.newest = stream.newest, now
        if len(self._streams) > _MAX_CLIENTS:
            self._forget_silent(now)
        return None

    def withdraw(self, client: Hashable, owner_before: Hashable | None) -> None:
        """Withdraw the setpoint that was noted last, because it cannot be flown.

        `owner_before` was in control before the setpoint.
        """
        self.owner = owner_before
        stream = self._streams[client]
        stream.newest = stream.previous

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
        """Whether a client sends a stream: its last two setpoints came in time."""
        stream = self._streams.get(client, _Stream())
        return self._is_live(client, now) and stream.newest - stream.previous <= self._timeout

    def begin(self, now: float) -> None:
        """Note the beginning of control; the hold of an owner that is already silent starts now."""
        stream = self._streams.setdefault(self.owner, _Stream())
        stream.newest = max(stream.newest, now - self._timeout)

    def release(self) -> None:
        """End the ownership: the owner has released control, or the vehicle has left our mode."""
        self.owner = None

    def state(self, now: float) -> ControlState:
        """What the vehicle does for its owner at `now`, s."""
        if self.owner is None:
            return ControlState.FREE
        overdue = now - self._streams.get(self.owner, _Stream()).newest - self._timeout
        if overdue <= 0.0:
            return ControlState.LIVE
        return ControlState.HOLDING if overdue <= self._hold else ControlState.EXPIRED

    def _is_live(self, client: Hashable, now: float) -> bool:
        return now - self._streams.get(client, _Stream()).newest <= self._timeout

    def _forget_silent(self, now: float) -> None:
        self._streams = {
            client: stream
            for client, stream in self._streams.items()
            if client == self.owner or self._is_live(client, now)
        }
