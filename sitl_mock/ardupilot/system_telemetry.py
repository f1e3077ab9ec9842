"""Telemetry of the autopilot's state in ArduCopter's conventions."""

from math import nan

from pymavlink.dialects.v20 import ardupilotmega
from pymavlink.dialects.v20 import development as dialect

from sitl_mock.ardupilot.boot import Boot
from sitl_mock.ardupilot.modes import MODE_NUMBERS, base_mode
from sitl_mock.autopilot.interface import Identity
from sitl_mock.autopilot.motion_telemetry import Builder
from sitl_mock.autopilot.state import State
from sitl_mock.autopilot.system_telemetry import NO_VALUE, SystemTelemetry
from sitl_mock.link.framing import Message
from sitl_mock.physics.geodesy import Geodetic
from sitl_mock.physics.vehicle import Vehicle

# Bits of SYS_STATUS, recorded disarmed, without control of height or position.
_SENSORS_PRESENT = 1399979055
_SENSORS_ENABLED = 1382128687
_SENSORS_HEALTHY = 1467063343
_HEIGHT_CONTROL = dialect.MAV_SYS_STATUS_SENSOR_Z_ALTITUDE_CONTROL
_POSITION_CONTROL = dialect.MAV_SYS_STATUS_SENSOR_XY_POSITION_CONTROL
_LOGGING = dialect.MAV_SYS_STATUS_LOGGING
_EKF_ALL_VALID = 0x33F
_EKF_NO_POSITION = (
    ardupilotmega.EKF_ATTITUDE
    | ardupilotmega.EKF_VELOCITY_VERT
    | ardupilotmega.EKF_POS_VERT_ABS
    | ardupilotmega.EKF_CONST_POS_MODE
)
_STICKS_US = (1500, 1500, 1000, 1500, 1800, 1000, 1000, 1800)
"""RC channels 1 to 8 of the simulated transmitter with its sticks at rest, us."""


class ArduPilotSystemTelemetry(SystemTelemetry):
    """Builds messages about the state, the battery, GPS and the estimator."""

    def __init__(
        self, state: State, origin: Geodetic, identity: Identity, vehicle: Vehicle, boot: Boot
    ) -> None:
        super().__init__(state, origin, identity, vehicle)
        self._boot = boot

    def builders(self) -> dict[int, Builder]:
        """Return message id -> builder."""
        return super().builders() | {
            dialect.MAVLINK_MSG_ID_HEARTBEAT: self.heartbeat,
            dialect.MAVLINK_MSG_ID_SYS_STATUS: self.sys_status,
            dialect.MAVLINK_MSG_ID_BATTERY_STATUS: self.battery_status,
            dialect.MAVLINK_MSG_ID_GPS_RAW_INT: self.gps_raw_int,
            dialect.MAVLINK_MSG_ID_RC_CHANNELS: self.rc_channels,
            ardupilotmega.MAVLINK_MSG_ID_EKF_STATUS_REPORT: self.ekf_status_report,
        }

    def heartbeat(self) -> Message:
        """Return HEARTBEAT; during the boot its base_mode is 89, with the guided bit (recorded)."""
        state = self._state
        position_controlled = state.position_controlled or not self._boot.initialised
        return dialect.MAVLink_heartbeat_message(
            dialect.MAV_TYPE_QUADROTOR,
            dialect.MAV_AUTOPILOT_ARDUPILOTMEGA,
            base_mode(armed=state.armed, position_controlled=position_controlled),
            MODE_NUMBERS[state.mode],
            self.system_status(),
            3,
        )

    def system_status(self) -> int:
        """Return MAV_STATE: 1 booting, 3 on the ground, armed or not, 4 flying, 5 in failsafe."""
        state = self._state
        if state.failsafe:
            return int(dialect.MAV_STATE_CRITICAL)
        if not self._boot.initialised:
            return int(dialect.MAV_STATE_BOOT)
        return int(dialect.MAV_STATE_STANDBY if state.landed else dialect.MAV_STATE_ACTIVE)

    def sys_status(self) -> Message:
        """Return SYS_STATUS, with the bits of running controllers and, while armed, of logging."""
        state = self._state
        controllers = _HEIGHT_CONTROL if state.height_controlled else 0
        controllers |= _POSITION_CONTROL if state.position_controlled else 0
        enabled = _SENSORS_ENABLED | controllers | (_LOGGING if state.armed else 0)
        return self._sys_status(_SENSORS_PRESENT, enabled, _SENSORS_HEALTHY | controllers, 0)

    def battery_status(self) -> Message:
        """Return BATTERY_STATUS, with the charge used since boot."""
        return self._battery_status(
            dialect.MAV_BATTERY_FUNCTION_UNKNOWN,
            dialect.MAV_BATTERY_TYPE_UNKNOWN,
            round(self._vehicle.battery.used_charge_a_s / 3.6),
            0,
        )

    def gps_raw_int(self) -> Message:
        """Return GPS_RAW_INT: no fix during the boot or without GPS, else an RTK fix (recorded)."""
        state = self._state
        if not state.gps_ok or not self._boot.initialised:
            return dialect.MAVLink_gps_raw_int_message(0, 0, 0, 0, 0, NO_VALUE, NO_VALUE, 0, 0, 0)
        return self._gps_fix(dialect.GPS_FIX_TYPE_RTK_FIXED, (121, 200), 0, (300, 300))

    def ekf_status_report(self) -> Message:
        """Return EKF_STATUS_REPORT with the recorded flags and typical variances."""
        if not self._boot.initialised:
            flags, variances = ardupilotmega.EKF_UNINITIALIZED, (0.0,) * 5
        elif not self._state.position_valid:
            flags, variances = _EKF_NO_POSITION, (0.0, 0.0, 0.001, 0.03, 0.0)
        else:
            flags, variances = _EKF_ALL_VALID, (0.006, 0.002, 0.001, 0.028, 0.0)
        return ardupilotmega.MAVLink_ekf_status_report_message(int(flags), *variances)

    def rc_channels(self) -> Message:
        """Return RC_CHANNELS: the sticks at rest."""
        channels = [*_STICKS_US, *(0,) * 10]
        return dialect.MAVLink_rc_channels_message(self._state.stamp_us // 1000, 16, *channels, 255)

    def home_position(self) -> Message | None:
        """Return HOME_POSITION, without attitude (recorded); None before home is set."""
        return self._home_position((nan, nan, nan, nan)) if self._boot.origin_set else None

    def gps_global_origin(self) -> Message | None:
        """Return GPS_GLOBAL_ORIGIN; None before the origin is set."""
        return super().gps_global_origin() if self._boot.origin_set else None
