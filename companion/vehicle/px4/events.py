"""PX4's events (EVENT, 410) as texts, for a link on which PX4 sends no STATUSTEXT.

PX4 sends STATUSTEXT only on links on which it receives heartbeats of type GCS. An event's number is
a hash of its name. The texts are in metadata that is not sent over the link, so this module has
the texts that matter to a flight (source: PX4 main, 2026; checked against recorded events). Any
other event that is meant for users is reported by its number, once.
"""

import struct
from collections.abc import Callable
from typing import NamedTuple

from companion.mavlink.texts import TextAssembler

_EVENT_PAYLOAD = struct.Struct("<IIHBBB40s")
"""Fields: id, time, sequence, destination (two bytes), log levels, arguments."""
_AUTOPILOT_COMPONENT = 1 << 24
_FNV_OFFSET, _FNV_PRIME = 0x811C9DC5, 0x01000193
_WARNING_SEVERITY, _INTERNAL_SEVERITY = 4, 8

_ARMING_REASONS = {
    1: "stick gesture",
    2: "RC switch",
    3: "internal command",
    4: "external command",
    5: "mission start",
    6: "landing",
    7: "auto preflight disarming",
    8: "kill switch",
    9: "lockdown",
    10: "failure detector",
    11: "shutdown request",
    13: "RC button",
    14: "failsafe",
}
_FAILSAFE_ACTIONS = {
    1: "warning",
    2: "fallback to position control",
    3: "fallback to altitude control",
    4: "fallback to stabilized",
    5: "hold",
    6: "RTL",
    7: "land",
    8: "descend",
    9: "disarm",
    10: "terminate",
}
_FAILSAFE_CAUSES = {
    1: "manual control loss",
    2: "GCS connection loss",
    3: "low battery level",
    4: "critical battery level",
    5: "emergency battery level",
    6: "low remaining flight time",
}


class _Template(NamedTuple):
    """Template of the text of an event."""

    text: str
    """The text with ``{}`` for each value."""
    layout: str = ""
    """`struct` format of the values in the event's arguments."""
    value_texts_by_number: tuple[dict[int, str] | None, ...] = ()
    """For each value: the text for each number, or None to show the number itself."""


_TEMPLATES_BY_NAME = {
    "commander_armed_by": _Template("Armed by {}", "<B", (_ARMING_REASONS,)),
    "commander_disarmed_by": _Template("Disarmed by {}", "<B", (_ARMING_REASONS,)),
    "commander_arm_denied_resolve_failures": _Template(
        "Arming denied: Resolve system health failures first"
    ),
    "commander_disarm_denied_not_landed": _Template("Disarming denied: not landed"),
    "commander_modeswitch_not_avail": _Template("Switching to that mode is currently not possible"),
    "commander_takeoff_detected": _Template("Takeoff detected"),
    "commander_landing_current_pos": _Template("Landing at current position"),
    "commander_landing_detected": _Template("Landing detected"),
    "commander_rtl": _Template("Returning to launch"),
    "navigator_takeoff_default_alt": _Template(
        "Using default takeoff altitude: {:.1f} m", "<f", (None,)
    ),
    "commander_failsafe_enter": _Template(
        "Failsafe activated due to {1}, triggering {0}",
        "<4xBB",
        (_FAILSAFE_ACTIONS, _FAILSAFE_CAUSES),
    ),
    "commander_failsafe_enter_generic": _Template(
        "Failsafe activated, triggering {}", "<4xB", (_FAILSAFE_ACTIONS,)
    ),
    "commander_failsafe_enter_autopilot_disengaged": _Template(
        "Failsafe activated, triggering {}", "<4xB", (_FAILSAFE_ACTIONS,)
    ),
    "commander_failsafe_enter_hold": _Template(
        "Failsafe activated due to {2}, triggering {0} in {1} seconds",
        "<4xBHB",
        (_FAILSAFE_ACTIONS, None, _FAILSAFE_CAUSES),
    ),
    "commander_failsafe_enter_generic_hold": _Template(
        "Failsafe activated, triggering {} in {} seconds", "<4xBH", (_FAILSAFE_ACTIONS, None)
    ),
    "commander_failsafe_enter_warn": _Template(
        "Failsafe warning triggered due to {}", "<4xB", (_FAILSAFE_CAUSES,)
    ),
    "commander_failsafe_enter_generic_warn": _Template("Failsafe warning triggered"),
    "commander_failsafe_enter_low_bat": _Template("Low battery level, return advised"),
    "commander_failsafe_enter_crit_bat_warn": _Template("Critical battery level, land now"),
    "commander_failsafe_enter_crit_low_bat_warn": _Template(
        "Emergency battery level, land immediately"
    ),
    "commander_rc_lost": _Template("Manual control lost"),
    "commander_rc_regained": _Template("Manual control regained"),
    "commander_rc_override": _Template("Pilot took over using sticks"),
    "failsafe_rc_override": _Template("Pilot took over using sticks"),
    "commander_gcs_lost": _Template("Connection to ground control station lost"),
    "commander_dl_regained": _Template("GCS connection regained"),
    "commander_mission_comp_lost": _Template("Connection to mission computer lost"),
    "commander_onboard_ctrl_regained": _Template("Onboard controller regained"),
}

_CHECK_TEXTS_BY_NAME = {
    "check_modes_attitude": "No valid attitude estimate",
    "check_modes_angular_velocity": "Angular velocity not valid",
    "check_modes_local_pos": "Navigation error: No valid position estimate",
    "check_modes_global_pos": "Navigation error: No valid global position estimate",
    "check_modes_local_alt": "Navigation error: No valid altitude estimate",
    "check_modes_home_position": "Home position not set",
    "check_modes_manual_control": "No manual control input",
    "check_modes_mission": "No valid mission available",
    "check_modes_cannot_takeoff": "Mode not suitable for arming",
    "check_rc_dl_no_dllink": "No connection to the ground control station",
}
"""Texts of the checks that a health report names as failing."""

_SETPOINT_CHECKS = (
    "check_modes_offboard_signal",
    "check_modes_offboard_no_signal",
    "check_modes_offboard_signal_lost",
)
"""Checks that fail while no setpoints are sent; their failures are not reported."""


def event_id(name: str) -> int:
    """The number of an event: the component in the top byte, then 24 bits of FNV-1a of its name."""
    value = _FNV_OFFSET
    for byte in name.encode():
        value = (value ^ byte) * _FNV_PRIME & 0xFFFFFFFF
    return _AUTOPILOT_COMPONENT | value & 0xFFFFFF


# The names of 17980399 and 30203637 are not known. Their texts come from the STATUSTEXTs that PX4
# sent together with them.
_TEMPLATES_BY_ID = {event_id(name): template for name, template in _TEMPLATES_BY_NAME.items()} | {
    17980399: _Template("Logging to {}-{:02}-{:02}/{:02}_{:02}_{:02}.ulg", "<H5B", (None,) * 6),
}
_CHECK_TEXTS_BY_ID = {event_id(name): text for name, text in _CHECK_TEXTS_BY_NAME.items()} | {
    30203637: "No heading reference",
}
_SETPOINT_CHECK_IDS = {event_id(name) for name in _SETPOINT_CHECKS}
_REPORT_BEGIN_ID = event_id("commander_arming_check_summary")
_REPORT_END_ID = event_id("commander_health_summary")


class EventReader:
    """Turns events into texts, which join the autopilot's STATUSTEXTs.

    PX4 sends a health report with all failing checks whenever one of them changes. A check is
    reported if it did not fail in the report before and its severity is warning or higher. Checks
    that fail only because no setpoints are sent are never reported.

    Args:
        clock: returns the event-loop time, s.
    """

    def __init__(self, texts: TextAssembler, clock: Callable[[], float]) -> None:
        self._text_assembler, self._clock = texts, clock
        self._failing_checks: set[int] = set()
        self._failing_in_last_report: set[int] = set()
        self._in_report = False
        self._last_sequence: int | None = None
        self._reported_unknown_ids: set[int] = set()

    def take(self, payload: bytes) -> None:
        """Take the payload of one EVENT."""
        event_number, _, sequence, _, _, log_levels, arguments = _EVENT_PAYLOAD.unpack(
            payload[: _EVENT_PAYLOAD.size].ljust(_EVENT_PAYLOAD.size, b"\0")
        )
        if sequence == self._last_sequence:
            return  # a repetition
        self._last_sequence = sequence
        severity = log_levels & 0x0F
        if event_number == _REPORT_BEGIN_ID:
            self._failing_checks, self._in_report = set(), True
        elif event_number == _REPORT_END_ID:
            self._failing_in_last_report, self._in_report = self._failing_checks, False
        elif self._in_report:
            self._failing_checks.add(event_number)
            unreported_checks = self._failing_in_last_report | _SETPOINT_CHECK_IDS
            if event_number not in unreported_checks and severity <= _WARNING_SEVERITY:
                self._add_text(severity, event_number, _CHECK_TEXTS_BY_ID.get(event_number))
        elif severity < _INTERNAL_SEVERITY:
            template = _TEMPLATES_BY_ID.get(event_number)
            self._add_text(severity, event_number, template and _fill_in(template, arguments))

    def _add_text(self, severity: int, number: int, text: str | None) -> None:
        if text is not None:
            self._text_assembler.take_event(severity, text, self._clock())
        elif number not in self._reported_unknown_ids:
            self._reported_unknown_ids.add(number)
            self._text_assembler.take_event(severity, f"unknown PX4 event {number}", self._clock())


def _fill_in(template: _Template, arguments: bytes) -> str:
    values = struct.unpack_from(template.layout, arguments)
    value_texts = (
        value if meaning is None else meaning.get(value, str(value))
        for value, meaning in zip(values, template.value_texts_by_number, strict=True)
    )
    return template.text.format(*value_texts)
