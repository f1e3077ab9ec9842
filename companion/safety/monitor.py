"""One monitor: a check of snapshots, how long a breach must last, and the action it causes."""

from collections.abc import Callable
from dataclasses import dataclass

from companion.safety.actions import Action, StreamEffect
from companion.safety.snapshot import Snapshot

BreachCheck = Callable[[Snapshot, bool], str | None]
"""Returns the breach in words, or None. The flag tells whether the alarm is already raised. `above`
and `below` use the flag for hysteresis, so that the alarm does not toggle at the limit."""

_HYSTERESIS = 0.9
"""A raised alarm ends only below this share of an upper limit, or above a lower limit divided by
this share.
"""


def with_hysteresis(limit: float, raised: bool) -> float:
    """The upper limit to use: `limit`, or 90 % of it while the alarm is raised."""
    return _HYSTERESIS * limit if raised else limit


def above(
    limit: float, value_in: Callable[[Snapshot], float | None], breach_of: Callable[[float], str]
) -> BreachCheck:
    """A check whose breach is a value above `limit`, with hysteresis.

    Args:
        limit: the largest value that is no breach.
        value_in: returns the value in a snapshot; None, unknown, is no breach.
        breach_of: returns the breach in words for a value.
    """

    def check(snapshot: Snapshot, raised: bool) -> str | None:
        value = value_in(snapshot)
        if value is None or value <= with_hysteresis(limit, raised):
            return None
        return breach_of(value)

    return check


def below(
    limit: float, value_in: Callable[[Snapshot], float | None], breach_of: Callable[[float], str]
) -> BreachCheck:
    """A check whose breach is a value below `limit`, with hysteresis; arguments as for `above`."""

    def check(snapshot: Snapshot, raised: bool) -> str | None:
        value = value_in(snapshot)
        if value is None or value >= (limit * (1.0 / _HYSTERESIS) if raised else limit):
            return None
        return breach_of(value)

    return check


@dataclass(frozen=True, slots=True)
class Monitor:
    """One monitor: a row of `companion.safety.table`."""

    name: str
    """Name in the documentation and in messages."""
    check: BreachCheck
    """Judges each snapshot, without a clock or memory of its own; see `BreachCheck`."""
    action: Action
    """Action that a breach leads to."""
    raise_after: float = 0.0
    """Time that a breach must last before the alarm is raised, s."""
    clear_after: float = 1.0
    """Time without the breach before the alarm ends, s."""
    action_after_hold: Action = Action.LAND
    """Action that follows if a hold does not end the breach."""
    stream: StreamEffect = StreamEffect.CONTINUES
    """Whether setpoints continue, end or stop if the breach ends control."""


class Alarm:
    """The state of one monitor in flight: debounce and hysteresis.

    Attributes:
        monitor: the row of the table.
        reason: the breach when the alarm was raised; None while it is not raised.
    """

    def __init__(self, monitor: Monitor) -> None:
        self.monitor = monitor
        self.reason: str | None = None
        self._change_seen_at: float | None = None

    def step(self, snapshot: Snapshot) -> bool:
        """Check one snapshot; return whether the alarm was raised or ended now."""
        breach = self.monitor.check(snapshot, self.reason is not None)
        if (breach is None) is (self.reason is None):
            self._change_seen_at = None
            return False
        if self._change_seen_at is None:
            self._change_seen_at = snapshot.now
        required_time = self.monitor.raise_after if breach is not None else self.monitor.clear_after
        if snapshot.now - self._change_seen_at < required_time:
            return False
        self.reason, self._change_seen_at = breach, None
        return True
