"""The ladder: every monitor judges the same snapshot; the most severe breach decides."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from companion.safety.actions import Action, StreamEffect
from companion.safety.monitor import Alarm, Monitor
from companion.safety.snapshot import Snapshot


class Verdict(NamedTuple):
    """The action that the flight must take now."""

    action: Action
    """HOLD, or an action that ends the flight."""
    reason: str
    """Description of the breach."""
    stream: StreamEffect = StreamEffect.CONTINUES
    """Whether setpoints continue, end or stop if `action` ends control."""


class SafetyLadder:
    """Escalates to the action of the most severe breach, and never de-escalates.

    The action HOLD aborts the maneuver and ends the flight. If all breaches with the action HOLD
    end within `hold_time`, the vehicle lands as soon as it is at rest, at the latest after
    `hold_time`. Otherwise the most severe `Monitor.action_after_hold` of the remaining breaches
    follows.

    Args:
        monitors: the monitors of the flight; among equally severe breaches the first one decides.
        hold_time: time allowed for the breaches to end during a hold, s.

    Attributes:
        note: called with a message when an alarm is raised or ended.
        on_change: called at the same time with: whether the alarm is raised, the name of the
            monitor, the reason, the action; reason and action are empty if the alarm has ended.
        breaches: name of the monitor by description of the breach, for all breaches so far.
    """

    def __init__(self, monitors: Sequence[Monitor], hold_time: float) -> None:
        self.note: Callable[[str], None] = lambda _: None
        self.on_change: Callable[[bool, str, str, str], None] = lambda *_: None
        self.breaches: dict[str, str] = {}
        self._alarms = [Alarm(monitor) for monitor in monitors]
        self._hold_time = hold_time
        self._hold_start: float | None = None
        self._hold_reason = ""

    @property
    def raised_alarms(self) -> tuple[str, ...]:
        """The names of the monitors with a raised alarm."""
        return tuple(alarm.monitor.name for alarm in self._alarms if alarm.reason is not None)

    def step(self, snapshot: Snapshot) -> Verdict | None:
        """Check one snapshot; return the action to take now, or None."""
        new_alarms = [
            alarm for alarm in self._alarms if alarm.step(snapshot) and self._report_change(alarm)
        ]
        worst = max(new_alarms, key=_severity, default=None)
        if worst is not None and worst.monitor.action.severity > Action.HOLD.severity:
            return _verdict(worst, worst.monitor.action)
        if self._hold_start is not None:
            return self._verdict_after_hold(snapshot, self._hold_start)
        if worst is not None and worst.monitor.action is Action.HOLD:
            self._hold_start, self._hold_reason = snapshot.now, worst.reason or ""
            return _verdict(worst, Action.HOLD)
        return None

    def _verdict_after_hold(self, snapshot: Snapshot, hold_start: float) -> Verdict | None:
        """The verdict if all breaches with HOLD have ended or `hold_time` is over; else None."""
        hold_alarms = [a for a in self._alarms if a.reason and a.monitor.action is Action.HOLD]
        hold_time_remains = snapshot.now - hold_start < self._hold_time
        if hold_time_remains and (hold_alarms or snapshot.motion.moves_to_hold):
            return None
        if not hold_alarms:
            return Verdict(Action.LAND, self._hold_reason)
        worst = max(hold_alarms, key=lambda alarm: alarm.monitor.action_after_hold.severity)
        return _verdict(worst, worst.monitor.action_after_hold)

    def _report_change(self, alarm: Alarm) -> bool:
        """Report that an alarm was raised or ended; return whether it was raised."""
        name = alarm.monitor.name
        if alarm.reason is None:
            self.note(f"safety: {name} alarm is over")
            self.on_change(False, name, "", "")
        else:
            self.breaches[alarm.reason] = name
            action = alarm.monitor.action.value
            self.note(f"safety: {name}: {alarm.reason} → {action}")
            self.on_change(True, name, alarm.reason, action)
        return alarm.reason is not None


def _severity(alarm: Alarm) -> int:
    return alarm.monitor.action.severity


def _verdict(alarm: Alarm, action: Action) -> Verdict:
    monitor = alarm.monitor
    return Verdict(action, alarm.reason or "", monitor.stream)
