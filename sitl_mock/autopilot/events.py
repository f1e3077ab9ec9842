"""The events that an autopilot announces."""

from collections.abc import Callable
from enum import Enum, auto
from typing import NamedTuple


class EventKind(Enum):
    """An event; each autopilot has its own texts for the events that it announces."""

    ARMED = auto()
    ARMING_DENIED = auto()
    PREFLIGHT_FAIL = auto()
    DISARMED_BY_COMMAND = auto()
    DISARMED_BY_LANDING = auto()
    DISARMED_ON_GROUND = auto()
    DISARMED_AFTER_CRASH = auto()
    DISARM_DENIED = auto()
    MODE_DENIED = auto()
    DEFAULT_TAKEOFF_ALTITUDE = auto()
    TAKEOFF_DETECTED = auto()
    LANDING_DETECTED = auto()
    LANDING_COMMANDED = auto()
    DISARMED_BY_FAILSAFE = auto()
    FAILSAFE = auto()
    FAILSAFE_UNNAMED = auto()
    FAILSAFE_HOLD = auto()
    FAILSAFE_WARNING = auto()
    GCS_LOST = auto()
    GCS_REGAINED = auto()
    COMPANION_LOST = auto()
    COMPANION_REGAINED = auto()
    POSITION_LOST = auto()
    BATTERY_LOW = auto()
    BATTERY_CRITICAL = auto()
    BATTERY_EMERGENCY = auto()
    PILOT_TOOK_OVER = auto()
    PILOT_LOST = auto()


class Event(NamedTuple):
    """How an autopilot announces an event: by STATUSTEXT, and by EVENT if it has an id.

    ``text`` may have one ``{}`` for a detail; ``severity`` is MAV_SEVERITY; ``event_id`` 0 = text
    only; ``arguments`` are the packed arguments of EVENT; ``internal_severity`` is the severity in
    the vehicle's log, None = the same.
    """

    text: str
    severity: int
    event_id: int = 0
    arguments: bytes = b""
    internal_severity: int | None = None


Announce = Callable[[EventKind, str], None]
"""Announces an event with a detail for its text."""
