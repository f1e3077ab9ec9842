"""PX4's failsafes: loss of a link, of offboard setpoints, of position; low battery."""

from dataclasses import dataclass, field

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.autopilot.events import EventKind
from sitl_mock.autopilot.parameters import ParameterTable
from sitl_mock.autopilot.state import BatteryWarning, Mode, State
from sitl_mock.px4.event_log import Announcer
from sitl_mock.px4.failsafe_actions import (
    LAND,
    OFFBOARD_ACTIONS,
    POSITION,
    RETURN,
    Cause,
    FailsafeActions,
)
from sitl_mock.px4.modes import PILOTED_MODES, POSITION_MODES, custom_mode

_NO_MANUAL_CONTROL = 4
"""Value of COM_RC_IN_MODE: no manual control."""
_EXCEPT_AUTO_BIT, _EXCEPT_OFFBOARD_BIT = 2, 4
"""Bits of COM_RCL_EXCEPT and COM_DLL_EXCEPT that exempt automatic modes and OFFBOARD."""
_GCS_MARGIN_US = 2_000_000
"""Delay beyond COM_DL_LOSS_T after which the ground station counts as lost, us (measured)."""
_ACTED_ALREADY = -1
"""Value that replaces the time of a loss once its failsafe has acted, so that it acts only once."""
_COMPANION_MARGIN_US = 1_500_000
"""Delay beyond COM_OBC_LOSS_T after which the companion counts as lost, us (measured)."""
_BATTERY_EVENTS = {
    BatteryWarning.LOW: EventKind.BATTERY_LOW,
    BatteryWarning.CRITICAL: EventKind.BATTERY_CRITICAL,
    BatteryWarning.EMERGENCY: EventKind.BATTERY_EMERGENCY,
}
_AUTO_MODES = frozenset({Mode.LOITER, Mode.TAKEOFF, Mode.RTL, Mode.LAND})


@dataclass(eq=False)
class Failsafe:
    """Detects losses, and starts failsafes while armed."""

    _state: State
    _parameters: ParameterTable
    _announce: Announcer
    _actions: FailsafeActions
    _pilot_present: bool = field(default=False, init=False)
    _pilot_optional: bool = field(default=True, init=False)
    _pilot_lost_us: int | None = field(default=None, init=False)
    _disarmed_warning_sent: bool = field(default=False, init=False)
    _gcs_heartbeat_us: int | None = field(default=None, init=False)
    _gcs_lost_us: int | None = field(default=None, init=False)
    _companion_heartbeat_us: int | None = field(default=None, init=False)
    _companion_lost: bool = field(default=False, init=False)

    def clear(self) -> None:
        """End any failsafe, because a mode was requested or the vehicle disarmed."""
        self._actions.clear()
        # A lost link that has caused a failsafe causes another one only after it was regained.
        if self._gcs_lost_us is not None:
            self._gcs_lost_us = _ACTED_ALREADY
        if self._pilot_lost_us is not None:
            self._pilot_lost_us = _ACTED_ALREADY

    def receive_heartbeat(self, heartbeat_type: int) -> None:
        """Record a heartbeat, whose MAV_TYPE is ``heartbeat_type``."""
        now_us = self._state.time_us
        if heartbeat_type == dialect.MAV_TYPE_GCS:
            self._gcs_heartbeat_us = now_us
        elif heartbeat_type == dialect.MAV_TYPE_ONBOARD_CONTROLLER:
            self._companion_heartbeat_us = now_us

    @property
    def gcs_alive(self) -> bool:
        """Whether a ground station is connected."""
        if self._gcs_heartbeat_us is None:
            return False
        timeout_us = self._parameters["COM_DL_LOSS_T"] * 1e6 + _GCS_MARGIN_US
        return self._state.time_us - self._gcs_heartbeat_us <= timeout_us

    def step(self, *, offboard_alive: bool, pilot_present: bool) -> None:
        """Check every failsafe once.

        Args:
            offboard_alive: whether offboard setpoints arrive.
            pilot_present: whether a pilot holds the sticks.
        """
        self._watch_companion()
        self._watch_battery()
        self._watch_gcs()
        self._watch_pilot(pilot_present=pilot_present)
        if self._state.armed:
            self._watch_position()
            self._watch_offboard(alive=offboard_alive)
        self._warn_disarmed(offboard_alive=offboard_alive)

    def _is_exempt(self, parameter: str) -> bool:
        """Whether a parameter exempts the intended mode from a failsafe."""
        exception_bits = int(self._parameters[parameter])
        mode = self._state.intended_mode
        if mode is Mode.OFFBOARD:
            return bool(exception_bits & _EXCEPT_OFFBOARD_BIT)
        return mode in _AUTO_MODES and bool(exception_bits & _EXCEPT_AUTO_BIT)

    def _watch_pilot(self, *, pilot_present: bool) -> None:
        """Detect the loss of sticks that were present, or that the mode needs."""
        state = self._state
        if pilot_present:
            self._pilot_lost_us = None
        elif self._pilot_present:
            self._announce(EventKind.PILOT_LOST, "")
        self._pilot_present = pilot_present
        # A pilot who was not present at arming is optional until he appears.
        self._pilot_optional = not pilot_present and (self._pilot_optional or not state.armed)
        sticks_expected = int(self._parameters["COM_RC_IN_MODE"]) != _NO_MANUAL_CONTROL
        sticks_optional = (
            not sticks_expected or self._pilot_optional or self._is_exempt("COM_RCL_EXCEPT")
        )
        if (
            pilot_present
            or not state.armed
            or (sticks_optional and state.intended_mode not in PILOTED_MODES)
        ):
            return
        if self._pilot_lost_us is None:
            self._pilot_lost_us = state.time_us
        if self._pilot_lost_us != _ACTED_ALREADY or state.mode in PILOTED_MODES:
            self._actions.act_on_link_loss(Cause.PILOT_LOST, "NAV_RCL_ACT", self._pilot_lost_us)

    def _watch_offboard(self, *, alive: bool) -> None:
        state = self._state
        if state.intended_mode is not Mode.OFFBOARD:
            return
        if state.mode is Mode.OFFBOARD and not alive:
            action = OFFBOARD_ACTIONS.get(int(self._parameters["COM_OBL_RC_ACT"]), POSITION)
            if action.mode in PILOTED_MODES and not self._pilot_present:
                action = RETURN
            self._actions.act(Cause.OFFBOARD_LOST, action)
        elif alive and self._actions.cause is Cause.OFFBOARD_LOST:
            self.clear()
            self._actions.enter(Mode.OFFBOARD)

    def _warn_disarmed(self, *, offboard_alive: bool) -> None:
        """Warn, and do no more, if disarmed in OFFBOARD without setpoints (recorded)."""
        state = self._state
        offboard_lost = not state.armed and state.mode is Mode.OFFBOARD and not offboard_alive
        if offboard_lost and not self._disarmed_warning_sent:
            mode = custom_mode(state.mode).to_bytes(4, "little")
            self._announce(EventKind.FAILSAFE_WARNING, "", mode)
        self._disarmed_warning_sent = offboard_lost

    def _watch_gcs(self) -> None:
        state = self._state
        if self._gcs_heartbeat_us is None:
            return
        if self.gcs_alive:
            if self._gcs_lost_us is not None:
                self._announce(EventKind.GCS_REGAINED, "")
            self._gcs_lost_us = None
            return
        if self._gcs_lost_us is None:
            self._gcs_lost_us = state.time_us
            self._announce(EventKind.GCS_LOST, "")
        loss_ignored = state.intended_mode is Mode.LAND or self._is_exempt("COM_DLL_EXCEPT")
        if state.armed and not loss_ignored and self._gcs_lost_us != _ACTED_ALREADY:
            self._actions.act_on_link_loss(Cause.GCS_LOST, "NAV_DLL_ACT", self._gcs_lost_us)

    def _watch_companion(self) -> None:
        if self._companion_heartbeat_us is None:
            return
        timeout_us = self._parameters["COM_OBC_LOSS_T"] * 1e6 + _COMPANION_MARGIN_US
        lost = self._state.time_us - self._companion_heartbeat_us > timeout_us
        if lost != self._companion_lost:
            self._companion_lost = lost
            self._announce(EventKind.COMPANION_LOST if lost else EventKind.COMPANION_REGAINED, "")

    def _watch_position(self) -> None:
        state = self._state
        if not state.position_valid and state.mode in POSITION_MODES:
            self._actions.act(Cause.POSITION_LOST, LAND)

    def _watch_battery(self) -> None:
        state, parameters = self._state, self._parameters
        if state.battery_remaining < parameters["BAT_EMERGEN_THR"]:
            warning = BatteryWarning.EMERGENCY
        elif state.battery_remaining < parameters["BAT_CRIT_THR"]:
            warning = BatteryWarning.CRITICAL
        elif state.battery_remaining < parameters["BAT_LOW_THR"]:
            warning = BatteryWarning.LOW
        else:
            warning = BatteryWarning.OK
        is_worse = warning > state.battery_warning
        state.battery_warning = warning
        if not is_worse:
            return
        self._announce(_BATTERY_EVENTS[warning], "")
        action = int(parameters["COM_LOW_BAT_ACT"])
        if not state.armed or action not in (2, 3) or warning < BatteryWarning.CRITICAL:
            return
        must_land = action == 2 or warning is BatteryWarning.EMERGENCY
        self._actions.act(Cause.BATTERY, LAND if must_land else RETURN)
