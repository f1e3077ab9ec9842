"""ArduCopter's failsafes: loss of ground station or position, low battery."""

from collections.abc import Callable
from dataclasses import dataclass, field

from sitl_mock.ardupilot.modes import PILOTED_MODES, POSITION_MODES
from sitl_mock.autopilot.events import Announce, EventKind
from sitl_mock.autopilot.parameters import ParameterTable
from sitl_mock.autopilot.state import BatteryWarning, Mode, State
from sitl_mock.link.framing import Message
from sitl_mock.physics.vehicle import Vehicle

_GCS_ACTIONS = {1: Mode.RTL, 3: Mode.RTL, 4: Mode.RTL, 5: Mode.LAND, 6: Mode.RTL, 7: Mode.BRAKE}
"""Mode for each value of FS_GCS_ENABLE. SMART_RTL (3, 4) and DO_LAND_START (6) are flown as RTL."""
_BATTERY_ACTIONS = {1: Mode.LAND, 2: Mode.RTL, 3: Mode.RTL, 4: Mode.RTL, 6: Mode.RTL, 7: Mode.BRAKE}
"""Mode for each value of BATT_FS_LOW_ACT and BATT_FS_CRT_ACT. Termination (5) is not simulated."""
_GCS_CONTINUE_IF_PILOT_CONTROL = 16
"""Bit of FS_OPTIONS: the loss of the ground station has no effect in a pilot's mode."""


@dataclass(eq=False)
class ArduPilotFailsafe:
    """Detects a lost ground station, a lost position and a low battery, and acts while armed.

    Each failsafe acts once, when it begins. The battery failsafe acts again when the charge becomes
    critical.
    """

    _state: State
    _parameters: ParameterTable
    _vehicle: Vehicle
    """The simulated vehicle, which has the battery's voltage."""
    _announce: Announce
    _start_failsafe: Callable[[Mode], None]
    """Enters the mode of a failsafe, or disarms a vehicle that is on the ground."""
    _gcs_heartbeat_us: int | None = field(default=None, init=False)
    gcs_lost: bool = field(default=False, init=False)
    """Whether the ground station failsafe is active."""
    _position_lost: bool = field(default=False, init=False)
    _voltage_low_since_us: int | None = field(default=None, init=False)

    def receive_heartbeat(self, heartbeat: Message) -> None:
        """Record a heartbeat; the ground station has the system id MAV_GCS_SYSID."""
        if heartbeat.get_srcSystem() == self._parameters["MAV_GCS_SYSID"]:
            self._gcs_heartbeat_us = self._state.time_us

    def step(self) -> None:
        """Check every failsafe once."""
        self._watch_gcs()
        self._watch_battery()
        self._watch_position()
        self._state.failsafe = (
            self.gcs_lost or self._position_lost or self._state.battery_warning > BatteryWarning.OK
        )

    def _watch_gcs(self) -> None:
        state, parameters = self._state, self._parameters
        action_number = int(parameters["FS_GCS_ENABLE"])
        if self._gcs_heartbeat_us is None:
            return
        timeout_us = parameters["FS_GCS_TIMEOUT"] * 1e6
        lost = bool(action_number) and state.time_us - self._gcs_heartbeat_us >= timeout_us
        if self.gcs_lost and not lost:
            self.gcs_lost = False
            self._announce(EventKind.GCS_REGAINED, "")
        elif lost and not self.gcs_lost and state.armed:
            self.gcs_lost = True
            self._announce(EventKind.GCS_LOST, "")
            pilot_continues = (
                int(parameters["FS_OPTIONS"]) & _GCS_CONTINUE_IF_PILOT_CONTROL
                and state.mode in PILOTED_MODES
            )
            mode = _GCS_ACTIONS.get(action_number)
            if mode is not None and not pilot_continues:
                self._start_failsafe(mode)

    def _watch_battery(self) -> None:
        state, parameters = self._state, self._parameters
        remaining_mah = state.battery_remaining * parameters["BATT_CAPACITY"]
        if remaining_mah < parameters["BATT_CRT_MAH"] or self._voltage_below("BATT_CRT_VOLT"):
            warning = BatteryWarning.CRITICAL
        elif remaining_mah < parameters["BATT_LOW_MAH"] or self._voltage_low():
            warning = BatteryWarning.LOW
        else:
            warning = BatteryWarning.OK
        if warning <= state.battery_warning:
            return  # the battery failsafe never ends
        state.battery_warning = warning
        is_critical = warning is BatteryWarning.CRITICAL
        used_mah = parameters["BATT_CAPACITY"] - remaining_mah
        battery = f"{self._vehicle.battery.voltage_v:.2f}V used {used_mah:.0f} mAh"
        kind = EventKind.BATTERY_CRITICAL if is_critical else EventKind.BATTERY_LOW
        self._announce(kind, battery)
        action = parameters["BATT_FS_CRT_ACT" if is_critical else "BATT_FS_LOW_ACT"]
        mode = _BATTERY_ACTIONS.get(int(action))
        if state.armed and mode is not None:
            self._start_failsafe(mode)

    def _voltage_below(self, parameter: str) -> bool:
        return self._vehicle.battery.voltage_v < self._parameters[parameter]

    def _voltage_low(self) -> bool:
        """Whether the voltage has been below BATT_LOW_VOLT for BATT_LOW_TIMER."""
        now_us = self._state.time_us
        if not self._voltage_below("BATT_LOW_VOLT"):
            self._voltage_low_since_us = None
            return False
        if self._voltage_low_since_us is None:
            self._voltage_low_since_us = now_us
        return now_us - self._voltage_low_since_us >= self._parameters["BATT_LOW_TIMER"] * 1e6

    def _watch_position(self) -> None:
        """Land if the position is lost in a mode that needs it and FS_EKF_ACTION demands it."""
        state = self._state
        lost = state.armed and not state.position_valid
        loss_began = lost and not self._position_lost and state.mode in POSITION_MODES
        self._position_lost = lost and (self._position_lost or loss_began)
        if loss_began and self._parameters["FS_EKF_ACTION"]:
            self._announce(EventKind.POSITION_LOST, "")
            self._start_failsafe(Mode.LAND)
