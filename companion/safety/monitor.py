"""One monitor: a judge of snapshots, how long a breach must last, and the action it causes."""

from collections.abc import Callable
from dataclasses import dataclass

from companion.safety.actions import Action, StreamEffect
from companion.safety.snapshot import Snapshot

Judge = Callable[[Snapshot, bool], str | None]
"""Returns the breach in words, or None. The flag tells whether the alarm is already raised; most
judges with a limit then use `with_hysteresis`, so that the alarm does not toggle at the limit.
"""

HYSTERESIS = 0.9
"""A raised alarm ends only below this share of an upper limit, or above a lower limit divided by
this share.
"""


def with_hysteresis(limit: float, raised: bool) -> float:
    """The upper limit to use: `limit`, or 90 % of it while the alarm is raised."""
    return HYSTERESIS * limit if raised else limit


def minimum_with_hysteresis(limit: float, raised: bool) -> float:
    """The lower limit to use: `limit`, or `limit` / 0.9 while the alarm is raised."""
    return limit * (1.0 / HYSTERESIS) if raised else limit


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
    """What becomes of the setpoints if the breach ends control."""


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
