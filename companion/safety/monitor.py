"""One monitor: a judge of snapshots, how long a breach must last, and what it leads to."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from companion.safety.ending import Exit
from companion.safety.snapshot import Snapshot

Judge = Callable[[Snapshot, bool], str | None]
"""What is wrong, in words, or None. The flag says that it has been wrong: a judge with a limit then
asks for a little less than the limit, so that it does not change its mind all the time."""

RELEASE = 0.9
"""What is over a limit is within it again only below this share of it."""


def released(limit: float, raised: bool) -> float:
    """The largest value that is not wrong."""
    return RELEASE * limit if raised else limit


class Action(Enum):
    """The rungs, from below; the value is the word in YAML."""

    WARN = "warn"
    """Say so, once, and fly on."""
    HOLD = "hold"
    """Give the maneuver up and hold where the vehicle is, still in offboard."""
    HAND_BACK = "hand_back"
    """Ask the autopilot to hold; it is left holding."""
    LAND = "land"
    """Hand back, and ask the autopilot to land."""
    RELEASE = "release"
    """Send nothing any more: the vehicle is its pilot's or its failsafe's."""

    @property
    def severity(self) -> int:
        """How far up it is."""
        return list(Action).index(self)


EXITS = {
    Action.HAND_BACK: Exit.HOLD,
    Action.LAND: Exit.LAND,
    Action.RELEASE: Exit.RELEASE,
}
"""How a flight ends that an action ends."""


@dataclass(frozen=True, slots=True)
class Monitor:
    """A row of the table.

    Attributes:
        name: as in the documentation and in YAML.
        judge: see `Judge`; it has no clock and no memory.
        action: what a breach leads to.
        lasts: how long it must last before, s.
        calm: how long it must be away to be over, s.
        then: what a hold that does not mend it leads to.
        mutes: setpoints stop at once, since what they are made from is not to be trusted.
    """

    name: str
    judge: Judge
    action: Action
    lasts: float = 0.0
    calm: float = 1.0
    then: Action = Action.LAND
    mutes: bool = False


class Alarm:
    """A monitor at work: debounce and hysteresis.

    Attributes:
        monitor: whose.
        reason: what was wrong when it was raised; None while it is not.
    """

    def __init__(self, monitor: Monitor) -> None:
        self.monitor = monitor
        self.reason: str | None = None
        self._since: float | None = None

    def step(self, snapshot: Snapshot) -> bool:
        """Look once; whether it was raised or was over just now."""
        wrong = self.monitor.judge(snapshot, self.reason is not None)
        if (wrong is None) is (self.reason is None):
            self._since = None
            return False
        if self._since is None:
            self._since = snapshot.now
        needed = self.monitor.lasts if wrong is not None else self.monitor.calm
        if snapshot.now - self._since < needed:
            return False
        self.reason, self._since = wrong, None
        return True
