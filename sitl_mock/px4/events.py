"""PX4's texts and event ids.

An event id is a hash of the event's name. Names and texts come from PX4's source (main, 2026); the
ids of these names agree with the recorded ids. If an announcement is sent as an EVENT as well, its
text ends in a tab.
"""

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.autopilot.events import Event, EventKind

_INFO = dialect.MAV_SEVERITY_INFO
_WARNING = dialect.MAV_SEVERITY_WARNING
_CRITICAL = dialect.MAV_SEVERITY_CRITICAL
_EMERGENCY = dialect.MAV_SEVERITY_EMERGENCY

_AUTOPILOT_COMPONENT = 1 << 24
_FNV_OFFSET, _FNV_PRIME = 0x811C9DC5, 0x01000193


def event_id(name: str) -> int:
    """Return an event's id: component in the top byte, then 24 bits of FNV-1a of the name."""
    value = _FNV_OFFSET
    for byte in name.encode():
        value = (value ^ byte) * _FNV_PRIME & 0xFFFFFFFF
    return _AUTOPILOT_COMPONENT | value & 0xFFFFFF


def _event(
    name: str,
    severity: int,
    text: str,
    arguments: bytes = b"",
    *,
    internal_severity: int | None = None,
) -> Event:
    return Event(text + "\t", severity, event_id(name), arguments, internal_severity)


PX4_EVENTS: dict[EventKind, Event] = {
    EventKind.ARMED: _event("commander_armed_by", _INFO, "Armed by external command", b"\x04"),
    EventKind.ARMING_DENIED: _event(
        "commander_arm_denied_resolve_failures",
        _CRITICAL,
        "Arming denied: Resolve system health failures first",
        internal_severity=_INFO,
    ),
    EventKind.PREFLIGHT_FAIL: Event("Preflight Fail: {}", _CRITICAL),
    EventKind.DISARMED_BY_COMMAND: _event(
        "commander_disarmed_by", _INFO, "Disarmed by external command", b"\x04"
    ),
    EventKind.DISARMED_BY_LANDING: _event(
        "commander_disarmed_by", _INFO, "Disarmed by landing", b"\x06"
    ),
    EventKind.DISARMED_ON_GROUND: _event(
        "commander_disarmed_by", _INFO, "Disarmed by auto preflight disarming", b"\x07"
    ),
    EventKind.DISARMED_AFTER_CRASH: _event(
        "commander_disarmed_by", _INFO, "Disarmed by failure detector", b"\x0a"
    ),
    EventKind.DISARMED_BY_FAILSAFE: _event(
        "commander_disarmed_by", _INFO, "Disarmed by failsafe", b"\x0e"
    ),
    EventKind.DISARM_DENIED: _event(
        "commander_disarm_denied_not_landed",
        _CRITICAL,
        "Disarming denied: not landed",
        internal_severity=_INFO,
    ),
    EventKind.MODE_DENIED: _event(
        "commander_modeswitch_not_avail",
        _CRITICAL,
        "Switching to mode '{}' is currently not possible",
        internal_severity=_INFO,
    ),
    EventKind.DEFAULT_TAKEOFF_ALTITUDE: _event(
        "navigator_takeoff_default_alt", _INFO, "Using default takeoff altitude: {} m"
    ),
    EventKind.TAKEOFF_DETECTED: _event("commander_takeoff_detected", _INFO, "Takeoff detected"),
    EventKind.LANDING_COMMANDED: _event(
        "commander_landing_current_pos", _INFO, "Landing at current position"
    ),
    EventKind.LANDING_DETECTED: _event("commander_landing_detected", _INFO, "Landing detected"),
    EventKind.FAILSAFE: _event(
        "commander_failsafe_enter", _CRITICAL, "Failsafe activated", internal_severity=_WARNING
    ),
    EventKind.FAILSAFE_UNNAMED: _event(
        "commander_failsafe_enter_generic",
        _CRITICAL,
        "Failsafe activated",
        internal_severity=_WARNING,
    ),
    EventKind.FAILSAFE_HOLD: _event(
        "commander_failsafe_enter_hold",
        _CRITICAL,
        "Failsafe activated, entering Hold for {} seconds",
        internal_severity=_WARNING,
    ),
    EventKind.FAILSAFE_WARNING: _event(
        "commander_failsafe_enter_generic_warn", _WARNING, "Failsafe activated"
    ),
    EventKind.PILOT_LOST: _event("commander_rc_lost", _INFO, "Manual control lost"),
    EventKind.GCS_LOST: _event(
        "commander_gcs_lost", _WARNING, "Connection to ground station lost", internal_severity=_INFO
    ),
    EventKind.GCS_REGAINED: _event("commander_dl_regained", _INFO, "GCS connection regained"),
    EventKind.COMPANION_LOST: _event(
        "commander_mission_comp_lost", _CRITICAL, "Connection to mission computer lost"
    ),
    EventKind.COMPANION_REGAINED: _event(
        "commander_onboard_ctrl_regained", _INFO, "Onboard controller regained"
    ),
    EventKind.BATTERY_LOW: _event(
        "commander_failsafe_enter_low_bat",
        _WARNING,
        "Low battery level, return advised",
        internal_severity=_INFO,
    ),
    EventKind.BATTERY_CRITICAL: _event(
        "commander_failsafe_enter_crit_bat_warn",
        _CRITICAL,
        "Critical battery level, land now",
        internal_severity=_INFO,
    ),
    EventKind.BATTERY_EMERGENCY: _event(
        "commander_failsafe_enter_crit_low_bat_warn",
        _EMERGENCY,
        "Emergency battery level, land immediately",
        internal_severity=_INFO,
    ),
    EventKind.PILOT_TOOK_OVER: _event(
        "commander_rc_override", _INFO, "Pilot took over using sticks"
    ),
}
