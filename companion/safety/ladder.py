"""The ladder: every monitor looks at the same snapshot, and the gravest breach decides."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from companion.safety.monitor import Action, Alarm, Monitor
from companion.safety.snapshot import Snapshot


class Verdict(NamedTuple):
    """What is to be done.

    Attributes:
        action: HOLD, or one that ends the flight.
        reason: in words.
        mutes: see `Monitor`.
    """

    action: Action
    reason: str
    mutes: bool = False


class SafetyLadder:
    """Climbs as far as the gravest breach asks, and never down again.

    A hold that mends what it was called for ends the flight by landing, since the maneuver is
    given up; one that does not within `hold_time` goes on to the monitor's next rung.

    Attributes:
        note: takes every transition, in words.

    Args:
        monitors: the table; among equals the first one speaks.
        hold_time: how long a hold may take to mend things, s.
    """

    def __init__(self, monitors: Sequence[Monitor], hold_time: float) -> None:
        self.note: Callable[[str], None] = lambda _: None
        self._alarms = [Alarm(monitor) for monitor in monitors]
        self._hold_time = hold_time
        self._held_at: float | None = None
        self._held_for = ""

    def step(self, snapshot: Snapshot) -> Verdict | None:
        """Look once; what is to be done now, if anything."""
        raised = [alarm for alarm in self._alarms if alarm.step(snapshot) and self._tell(alarm)]
        gravest = max(raised, key=_rung, default=None)
        if gravest is not None and gravest.monitor.action.severity > Action.HOLD.severity:
            return _verdict(gravest, gravest.monitor.action)
        if self._held_at is not None:
            return self._after_hold(snapshot.now, self._held_at)
        if gravest is not None and gravest.monitor.action is Action.HOLD:
            self._held_at, self._held_for = snapshot.now, gravest.reason or ""
            return _verdict(gravest, Action.HOLD)
        return None

    def _after_hold(self, now: float, held_at: float) -> Verdict | None:
        """Whether holding has mended it, or has had its time."""
        wrong = [a for a in self._alarms if a.reason and a.monitor.action is Action.HOLD]
        if not wrong:
            return Verdict(Action.LAND, self._held_for)
        if now - held_at < self._hold_time:
            return None
        gravest = max(wrong, key=lambda alarm: alarm.monitor.then.severity)
        return _verdict(gravest, gravest.monitor.then)

    def _tell(self, alarm: Alarm) -> bool:
        """Tell a transition; whether the alarm was raised by it."""
        name = alarm.monitor.name
        if alarm.reason is None:
            self.note(f"safety: {name} is over")
        else:
            self.note(f"safety: {name}: {alarm.reason} → {alarm.monitor.action.value}")
        return alarm.reason is not None


def _rung(alarm: Alarm) -> int:
    return alarm.monitor.action.severity


def _verdict(alarm: Alarm, action: Action) -> Verdict:
    return Verdict(action, alarm.reason or "", alarm.monitor.mutes)
