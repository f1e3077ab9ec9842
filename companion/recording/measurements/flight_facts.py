"""What happened in a flight: phases, end, and the circumstances that the verdict considers."""

from dataclasses import dataclass, field
from math import degrees
from typing import Any


@dataclass(frozen=True, slots=True)
class EarlyEnd:
    """Time, phase and cause of the end of a flight that failed in one of its phases.

    Attributes:
        time: time since the flight began, s.
        since_takeoff: time since `FlightFacts.takeoff`, s; None: the vehicle was on the ground.
        phase: the phase that failed.
        maneuver: the maneuver that ran, or the last one before the vehicle held; None: another
            phase ran, or no maneuver had begun.
        into_maneuver: time from the beginning of `maneuver` to the end of the flight, or to the
            hold, s; None: no maneuver.
        monitor: name of the safety monitor that ended the flight, or None.
    """

    time: float
    since_takeoff: float | None
    phase: str
    maneuver: str | None = None
    into_maneuver: float | None = None
    monitor: str | None = None

    def as_dict(self) -> dict[str, Any]:
        """The early end as JSON."""
        return {
            "time_s": _rounded(self.time),
            "since_takeoff_s": _rounded(self.since_takeoff),
            "phase": self.phase,
            "maneuver": self.maneuver,
            "into_maneuver_s": _rounded(self.into_maneuver),
            "monitor": self.monitor,
        }


@dataclass(frozen=True, slots=True)
class FlightFacts:
    """What happened in a flight, besides its figures. Times in s since the flight began.

    Attributes:
        began: beginning of the flight, s on our clock.
        phases: beginning and name of each phase.
        takeoff: time when the vehicle left the ground, or when the checks for a takeover in the air
            passed; None: neither happened.
        early_end: the early end; None: no phase failed.
        vehicle_uid: hardware id of the vehicle's autopilot; None: unknown.
        armed: whether the vehicle is armed at the end; None: unknown.
        mode: mode of the vehicle at the end; None: unknown.
        unheard: how long the vehicle was silent at the end, s, so that `armed` and `mode` may have
            changed since; None: it was heard.
        battery: remaining charge, 0..1, at take-off and at the end; None: unknown.
        min_battery: smallest remaining charge allowed, 0..1, `limits.min_battery_percent`.
        max_tilt: largest tilt of a target, `limits.max_tilt_deg`, rad; None: unknown.
        deadline: longest latency allowed, `deadman.deadline_ms`, s.
        lockstep: whether the flight ran in vehicle time (in lockstep or on a virtual clock); then
            latencies are meaningless.
        advice: sentences on what differs from the configuration (hover thrust, drag, dead time),
            and on rows of the figures that were lost.
        gain_warning: a sentence if the gain is above the largest sensible one, or None.
        settings: keys of hover thrust and drag that the advice names, with values for `--set`.
        changes: changes in flight, each with `time_s`, `by` and `keys` (values before and after).
    """

    began: float = 0.0
    phases: tuple[tuple[float, str], ...] = ()
    takeoff: float | None = None
    early_end: EarlyEnd | None = None
    vehicle_uid: str | None = None
    armed: bool | None = None
    mode: str | None = None
    unheard: float | None = None
    battery: tuple[float | None, float | None] = (None, None)
    min_battery: float = 0.0
    max_tilt: float | None = None
    deadline: float = 0.004
    lockstep: bool = False
    advice: tuple[str, ...] = ()
    gain_warning: str | None = None
    settings: dict[str, str] = field(default_factory=dict)
    changes: tuple[dict[str, Any], ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """The facts as JSON."""
        begin, end = self.battery
        return {
            "lockstep": self.lockstep,
            "deadline_ms": _rounded(1e3 * self.deadline),
            "phases": [{"time_s": _rounded(time), "name": name} for time, name in self.phases],
            "takeoff_s": _rounded(self.takeoff),
            "early_end": None if self.early_end is None else self.early_end.as_dict(),
            "vehicle_uid": self.vehicle_uid,
            "at_the_end": {
                "armed": self.armed,
                "mode": self.mode,
                "unheard_s": _rounded(self.unheard),
            },
            "battery": {"takeoff": begin, "end": end, "min": self.min_battery},
            "advice": list(self.advice),
            "gain_warning": self.gain_warning,
            "max_tilt_deg": None if self.max_tilt is None else _rounded(degrees(self.max_tilt)),
            "settings": self.settings,
            "changes": list(self.changes),
        }


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 3)
