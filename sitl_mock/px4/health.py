"""PX4's health report: events with the failing checks, and the modes that can be armed.

The bytes of the events are those that a PX4 sent. An event's id is a hash of its name; the names
here are those in PX4's source that have this hash.
"""

import struct
from collections.abc import Iterable
from typing import NamedTuple

from sitl_mock.autopilot.state import State
from sitl_mock.px4.event_log import EventLog
from sitl_mock.px4.events import event_id

_CRITICAL, _ERROR, _WARNING, _INFO, _PROTOCOL_SEVERITY = 2, 3, 4, 6, 8
"""MAV_SEVERITY; 8 = for programs only."""

_ALL_MODES = 0xFFFFFFFF
_ARMABLE_MODES = 0x807F7AB0
"""Bit mask of the modes in which PX4 arms without a transmitter, if no check fails."""
_SENSORS_PRESENT = 0x38020D02
_GPS_PRESENT = 1 << 3
_GCS_PRESENT = 1 << 12
_PERIOD_US = 2_000_000
"""Minimum time between two reports."""

_SUMMARY_LAYOUT = struct.Struct("<BIIII")
"""Fields: chunk; components with errors, with warnings; modes that can be armed, that can run."""
_FAILURE_LAYOUT = struct.Struct("<IB")
"""Fields: affected modes, component."""
_HEALTH_LAYOUT = struct.Struct("<BIII")
"""Fields: chunk; components present, with errors, with warnings."""


class _Check(NamedTuple):
    """A failing check.

    ``modes`` is the bit mask of the affected modes. ``health_component`` is the number of the part
    of the vehicle in the health report.
    """

    event_id: int
    modes: int
    health_component: int
    severity: int


_HEADING = _Check(30203637, 0x7E00FC, 17, _ERROR)
"""Failed in recordings while the heading was unknown. The name behind the event's id is unknown."""
_OFFBOARD = _Check(event_id("check_modes_offboard_signal_lost"), 0x4000, 20, _ERROR)
_ATTITUDE = _Check(event_id("check_modes_attitude"), 0x7ED1FE, 16, _CRITICAL)
_LOCAL_POSITION = _Check(event_id("check_modes_local_pos"), 0x7E00FC, 17, _ERROR)
_GLOBAL_POSITION = _Check(event_id("check_modes_global_pos"), 0x38, 24, _ERROR)
_MISSION = _Check(event_id("check_modes_mission"), 0x08, 20, _INFO)
_NO_PILOT = _Check(event_id("check_modes_manual_control"), _ALL_MODES, 7, _WARNING)
_NO_GCS = _Check(event_id("check_rc_dl_no_dllink"), _ALL_MODES, 12, _INFO)
_GCS_REQUIRED = _NO_GCS._replace(severity=_ERROR)


class HealthReport:
    """Sends a report when it changed, at least two seconds after the last one.

    Args:
        ready_us: vehicle time at which the estimator is ready.
    """

    def __init__(self, state: State, events: EventLog, ready_us: int) -> None:
        self._state = state
        self._events = events
        self._ready_us = ready_us
        self._last_report: tuple[tuple[_Check, ...], int] | None = None
        self._last_report_us = 0

    def step(
        self, *, offboard_alive: bool, pilot_present: bool, gcs_alive: bool, gcs_required: bool
    ) -> None:
        """Call `EventLog.step`, and send a report if it changed and is due.

        Args:
            offboard_alive: whether offboard setpoints arrive.
            pilot_present: whether a pilot holds the sticks.
            gcs_alive: whether a ground station is connected.
            gcs_required: whether arming needs a ground station.
        """
        state = self._state
        self._events.step()
        if state.time_us - self._last_report_us < _PERIOD_US:
            return
        gcs_check = None if gcs_alive else _GCS_REQUIRED if gcs_required else _NO_GCS
        possible_checks = (
            _HEADING if state.time_us < self._ready_us // 2 else None,
            None if offboard_alive else _OFFBOARD,
            _ATTITUDE if state.time_us < self._ready_us // 2 else None,
            None if self._position_ready else _LOCAL_POSITION,
            None if self._position_ready else _GLOBAL_POSITION,
            _MISSION,
            None if pilot_present else _NO_PILOT,
            gcs_check,
        )
        failing_checks = tuple(check for check in possible_checks if check is not None)
        gps_present = state.gps_ok and state.position_valid
        components_present = (
            _SENSORS_PRESENT
            | (_GPS_PRESENT if gps_present else 0)
            | (_GCS_PRESENT if gcs_alive else 0)
        )
        if (failing_checks, components_present) != self._last_report:
            self._last_report = (failing_checks, components_present)
            self._last_report_us = state.time_us
            self._send(failing_checks, components_present)

    @property
    def _position_ready(self) -> bool:
        return self._state.position_valid and self._state.time_us >= self._ready_us

    def _send(self, failing_checks: tuple[_Check, ...], components_present: int) -> None:
        errors = [check for check in failing_checks if check.severity <= _ERROR]
        warnings = [check for check in failing_checks if check.severity == _WARNING]
        armable_modes = _ARMABLE_MODES
        for check in errors:
            armable_modes &= ~check.modes
        summary = _SUMMARY_LAYOUT.pack(
            0, _components(errors), _components(warnings), armable_modes, armable_modes
        )
        send = self._events.send
        send(event_id("commander_arming_check_summary"), _PROTOCOL_SEVERITY, arguments=summary)
        for check in failing_checks:
            send(
                check.event_id,
                check.severity,
                arguments=_FAILURE_LAYOUT.pack(check.modes, check.health_component),
            )
        health = _HEALTH_LAYOUT.pack(0, components_present, 0, 0)
        send(event_id("commander_health_summary"), _PROTOCOL_SEVERITY, arguments=health)


def _components(checks: Iterable[_Check]) -> int:
    """Return the bit mask of the vehicle's parts (`health_component`) to which checks belong."""
    bits = 0
    for check in checks:
        bits |= 1 << check.health_component
    return bits
