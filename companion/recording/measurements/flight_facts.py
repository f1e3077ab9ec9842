"""What happened in a flight: phases, end, and the circumstances that the verdict considers."""

from dataclasses import dataclass, field
from math import degrees
from typing import Any


@dataclass(frozen=True, slots=True)
class EarlyEnd:
    """Time, phase and cause of the end of a flight that failed in one of its phases."""

    time: float
    """Time since the flight began, s."""
    since_takeoff: float | None
    """Time since `FlightFacts.takeoff_time`, s; None: the vehicle was on the ground."""
    phase: str
    """The phase that failed."""
    maneuver: str | None = None
    """The maneuver that ran, or the last one before a safety hold; None: another phase ran, or no
    maneuver had begun."""
    time_in_maneuver: float | None = None
    """Time from the beginning of `maneuver` to the end of the flight or to the safety hold, s;
    None: no maneuver."""
    monitor: str | None = None
    """Name of the safety monitor that ended the flight, or None."""

    def as_dict(self) -> dict[str, Any]:
        """The early end as JSON."""
        return {
            "time_s": _rounded(self.time),
            "since_takeoff_s": _rounded(self.since_takeoff),
            "phase": self.phase,
            "maneuver": self.maneuver,
            "into_maneuver_s": _rounded(self.time_in_maneuver),
            "monitor": self.monitor,
        }


@dataclass(frozen=True, slots=True)
class FlightFacts:
    """What happened in a flight, besides its figures. Times in s since the flight began."""

    start_time: float = 0.0
    """Beginning of the flight, s on our clock."""
    phases: tuple[tuple[float, str], ...] = ()
    """Beginning and name of each phase."""
    takeoff_time: float | None = None
    """Time when the vehicle left the ground, or when the checks for a takeover in the air passed;
    None: neither happened."""
    early_end: EarlyEnd | None = None
    """The early end; None: no phase failed."""
    vehicle_uid: str | None = None
    """Hardware id of the vehicle's autopilot; None: unknown."""
    armed: bool | None = None
    """Whether the vehicle is armed at the end; None: unknown."""
    mode: str | None = None
    """Mode of the vehicle at the end; None: unknown."""
    silence: float | None = None
    """Time since the vehicle was last heard, s; `armed` and `mode` may have changed since. None: it
    was heard to the end."""
    tilt: float | None = None
    """Tilt of the vehicle at the end, rad; None: unknown."""
    battery: tuple[float | None, float | None] = (None, None)
    """Remaining charge, 0..1, at take-off and at the end; None: unknown."""
    min_battery: float = 0.0
    """Smallest remaining charge allowed, 0..1, `limits.min_battery_percent`."""
    max_tilt: float | None = None
    """Largest tilt of a target, `limits.max_tilt_deg`, rad; None: unknown."""
    deadline: float = 0.004
    """Longest latency allowed, `deadman.deadline_ms`, s."""
    lockstep: bool = False
    """Whether the flight ran in vehicle time (in lockstep or on a virtual clock); then latencies
    are meaningless."""
    advice: tuple[str, ...] = ()
    """Sentences on what differs from the configuration (hover thrust, drag, dead time), and on lost
    rows of the data from which the figures are computed."""
    gain_warning: str | None = None
    """A sentence if the planner's gain is too high, or None."""
    settings: dict[str, str] = field(default_factory=dict)
    """Keys of hover thrust and drag that the advice names, with values for `--set`."""
    drag_learned: str | None = None
    """A sentence if the learned drag differs much from the assumed drag and is stored for the
    vehicle's next flight; or None."""
    changes: tuple[dict[str, Any], ...] = ()
    """Changes in flight, each with `time_s`, `by` and `keys` (values before and after)."""

    def as_dict(self) -> dict[str, Any]:
        """The facts as JSON."""
        charge_at_takeoff, charge_at_end = self.battery
        return {
            "lockstep": self.lockstep,
            "deadline_ms": _rounded(1e3 * self.deadline),
            "phases": [{"time_s": _rounded(time), "name": name} for time, name in self.phases],
            "takeoff_s": _rounded(self.takeoff_time),
            "early_end": None if self.early_end is None else self.early_end.as_dict(),
            "vehicle_uid": self.vehicle_uid,
            "at_the_end": {
                "armed": self.armed,
                "mode": self.mode,
                "unheard_s": _rounded(self.silence),
                "tilt_deg": _in_degrees(self.tilt),
            },
            "battery": {
                "takeoff": charge_at_takeoff,
                "end": charge_at_end,
                "min": self.min_battery,
            },
            "advice": list(self.advice),
            "gain_warning": self.gain_warning,
            "max_tilt_deg": _in_degrees(self.max_tilt),
            "settings": self.settings,
            "drag_learned": self.drag_learned,
            "changes": list(self.changes),
        }


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 3)


def _in_degrees(angle: float | None) -> float | None:
    return None if angle is None else round(degrees(angle), 3)
