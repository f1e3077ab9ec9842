"""Telemetry of the autopilot's state that all autopilots build alike."""

from dataclasses import dataclass
from math import hypot

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.autopilot.interface import Identity
from sitl_mock.autopilot.motion_telemetry import Builder, clip
from sitl_mock.autopilot.state import State
from sitl_mock.link.framing import Message
from sitl_mock.physics.geodesy import Geodetic, to_geodetic
from sitl_mock.physics.quaternion import Quaternion
from sitl_mock.physics.vehicle import Vehicle

UNIX_AT_BOOT_US = 1_795_236_148_441_838
"""Unix time of SYSTEM_TIME at boot; fixed, so that a run is reproducible to the bit."""
_PREARM_CHECK = dialect.MAV_SYS_STATUS_PREARM_CHECK
_GPS_SENSOR = dialect.MAV_SYS_STATUS_SENSOR_GPS
NO_VALUE = 65535
"""Content of an unsigned 16-bit field that has no value."""


@dataclass(eq=False)
class SystemTelemetry:
    """Builds messages about state and link; an autopilot adds its own."""

    _state: State
    _origin: Geodetic
    _identity: Identity
    _vehicle: Vehicle
    """The simulated vehicle, whose battery is reported."""

    def builders(self) -> dict[int, Builder]:
        """Return message id -> builder."""
        return {
            dialect.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: self.extended_sys_state,
            dialect.MAVLINK_MSG_ID_HOME_POSITION: self.home_position,
            dialect.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN: self.gps_global_origin,
            dialect.MAVLINK_MSG_ID_SYSTEM_TIME: self.system_time,
            dialect.MAVLINK_MSG_ID_TIMESYNC: self.timesync,
            dialect.MAVLINK_MSG_ID_MISSION_CURRENT: self.mission_current,
            dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION: self.autopilot_version,
        }

    def extended_sys_state(self) -> Message:
        """Return EXTENDED_SYS_STATE, with the land detector's state."""
        return dialect.MAVLink_extended_sys_state_message(0, int(self._state.landed_state))

    def _sys_status(self, present: int, enabled: int, healthy: int, load: int) -> Message:
        """Return SYS_STATUS, with the health bits of failing parts cleared. ``load`` is in 0.1 %.

        Clients read from the pre-arm bit whether the vehicle can be armed.
        """
        if self._state.prearm_problem is not None:
            healthy &= ~_PREARM_CHECK
        if not self._state.gps_ok:
            healthy &= ~_GPS_SENSOR
        battery = self._vehicle.battery
        return dialect.MAVLink_sys_status_message(
            present,
            enabled,
            healthy,
            load,
            clip(battery.voltage_v * 1e3, 15),
            clip(battery.current_a * 1e2, 15),
            round(100 * battery.remaining),
            *(0,) * 6,
        )

    def _battery_status(
        self, function: int, battery_type: int, used_mah: int, used_hj: int
    ) -> Message:
        """Return BATTERY_STATUS; as in both autopilots, cell 1 has the voltage of the pack.

        ``used_mah`` is the used charge, mAh; ``used_hj`` the used energy, hJ.
        """
        battery = self._vehicle.battery
        return dialect.MAVLink_battery_status_message(
            0,
            function,
            battery_type,
            32767,
            [round(battery.voltage_v * 1e3)] + [NO_VALUE] * 9,
            clip(battery.current_a * 1e2, 15),
            used_mah,
            used_hj,
            round(100 * battery.remaining),
            0,
            int(self._state.battery_warning),
        )

    def _gps_fix(
        self, fix: int, dilutions: tuple[int, int], course: int, accuracies: tuple[int, ...]
    ) -> Message:
        """Return GPS_RAW_INT at the estimated position; arguments in the units of the message."""
        state = self._state
        position = to_geodetic(self._origin, state.estimate.position_ned).as_integers()
        vx, vy, _ = state.estimate.velocity_ned
        return dialect.MAVLink_gps_raw_int_message(
            state.stamp_us,
            fix,
            *position,
            *dilutions,
            clip(hypot(vx, vy) * 100, 15),
            course,
            10,
            position[2],
            *accuracies,
        )

    def home_position(self) -> Message | None:
        """Return HOME_POSITION, with the attitude when home was set."""
        return self._home_position(self._state.home_q)

    def _home_position(self, q: Quaternion) -> Message:
        state = self._state
        return dialect.MAVLink_home_position_message(
            *to_geodetic(self._origin, state.home_ned).as_integers(),
            *state.home_ned,
            q,
            0.0,
            0.0,
            0.0,
            state.home_set_at_us,
        )

    def gps_global_origin(self) -> Message | None:
        """Return GPS_GLOBAL_ORIGIN, the origin of the local frame."""
        return dialect.MAVLink_gps_global_origin_message(*self._origin.as_integers(), 0)

    def system_time(self) -> Message:
        """Return SYSTEM_TIME: Unix time and time since boot."""
        stamp_us = self._state.stamp_us
        return dialect.MAVLink_system_time_message(UNIX_AT_BOOT_US + stamp_us, stamp_us // 1000)

    def timesync(self) -> Message:
        """Return a TIMESYNC request with the vehicle's clock, ns."""
        return dialect.MAVLink_timesync_message(0, self._state.stamp_us * 1000)

    def mission_current(self) -> Message:
        """Return MISSION_CURRENT: there is no mission."""
        return dialect.MAVLink_mission_current_message(0, NO_VALUE, 1, 2)

    def autopilot_version(self) -> Message:
        """Return AUTOPILOT_VERSION, with the autopilot's `Identity`."""
        identity = self._identity
        return dialect.MAVLink_autopilot_version_message(
            identity.capabilities,
            identity.flight_sw_version,
            identity.middleware_sw_version,
            identity.os_sw_version,
            identity.board_version,
            identity.flight_custom_version,
            identity.flight_custom_version,
            (0,) * 8,
            0,
            0,
            identity.uid,
            identity.uid2,
        )
