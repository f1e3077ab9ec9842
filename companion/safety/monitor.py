"""One monitor: a judge of snapshots, how long a breach must last, and the action it causes."""

from collections.abc import Callable
from dataclasses import dataclass

from companion.safety.actions import Action, StreamEffect
from companion.safety.snapshot import Snapshot

Judge = Callable[[Snapshot, bool], str | None]
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
    limit: float,
    value_in: Callable[[Snapshot], float | None],
    breach_of: Callable[[float], str],
) -> Judge:
    """A judge whose breach is a value above `limit`, with hysteresis.

    Args:
        limit: the largest value that is no breach.
        value_in: returns the value in a snapshot; None, unknown, is no breach.
        breach_of: returns the breach in words for a value.
    """

    def judge(snapshot: Snapshot, raised: bool) -> str | None:
        value = value_in(snapshot)
        if value is None or value <= with_hysteresis(limit, raised):
            return None
        return breach_of(value)

    return judge


def below(
    limit: float,
    value_in: Callable[[Snapshot], float | None],
    breach_of: Callable[[float], str],
) -> Judge:
    """A judge whose breach is a value below `limit`, with hysteresis; arguments as for `above`."""

    def judge(snapshot: Snapshot, raised: bool) -> str | None:
        value = value_in(snapshot)
        if value is None or value >= (limit * (1.0 / _HYSTERESIS) if raised else limit):
            return None
        return breach_of(value)

    return judge


@dataclass(frozen=True, slots=True)
class Monitor:
    """One monitor: a row of `companion.safety.table`."""

    name: str
    """Name in the documentation and in messages."""
    judge: Judge
    """Judges each snapshot, without a clock or memory of its own; see `Judge`."""
    action: Action
    """Action that a breach leads to."""
    lasts: float = 0.0
    """Time that a breach must last before the alarm is raised, s."""
    calm: float = 1.0
    """Time without the breach before the alarm ends, s."""
    then: Action = Action.LAND
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
        self._since: float | None = None

    def step(self, snapshot: Snapshot) -> bool:
        """Judge one snapshot; return whether the alarm was raised or ended now."""
        breach = self.monitor.judge(snapshot, self.reason is not None)
        if (breach is None) is (self.reason is None):
            self._since = None
            return False
        if self._since is None:
            self._since = snapshot.now
        needed = self.monitor.lasts if breach is not None else self.monitor.calm
        if snapshot.now - self._since < needed:
            return False
        self.reason, self._since = breach, None
        return True
