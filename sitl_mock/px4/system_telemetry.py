"""Telemetry of the autopilot's state in PX4's conventions."""

from math import nan

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.autopilot.interface import Identity
from sitl_mock.autopilot.motion_telemetry import Builder
from sitl_mock.autopilot.setpoints import AttitudeSetpoint, OffboardStream
from sitl_mock.autopilot.state import State
from sitl_mock.autopilot.system_telemetry import NO_VALUE, SystemTelemetry
from sitl_mock.link.framing import Message
from sitl_mock.physics.geodesy import Geodetic
from sitl_mock.physics.vehicle import Vehicle
from sitl_mock.px4.modes import base_mode, custom_mode, standard_mode

# Bits of SYS_STATUS, recorded.
_SENSORS_PRESENT = 50380847
_SENSORS_ENABLED = 50446383
_SENSORS_HEALTHY = 320915519
# Flags of ESTIMATOR_STATUS, recorded.
_ESTIMATOR_IN_AIR = 895
_ESTIMATOR_ON_GROUND = 1023
_ESTIMATOR_NO_POSITION = 164


class Px4SystemTelemetry(SystemTelemetry):
    """Builds messages about the state, the battery, GPS and the link."""

    def __init__(
        self,
        state: State,
        origin: Geodetic,
        identity: Identity,
        vehicle: Vehicle,
        stream: OffboardStream,
    ) -> None:
        super().__init__(state, origin, identity, vehicle)
        self._stream = stream
        self._next_ping = 0

    def builders(self) -> dict[int, Builder]:
        """Return message id -> builder."""
        return super().builders() | {
            dialect.MAVLINK_MSG_ID_HEARTBEAT: self.heartbeat,
            dialect.MAVLINK_MSG_ID_CURRENT_MODE: self.current_mode,
            dialect.MAVLINK_MSG_ID_SYS_STATUS: self.sys_status,
            dialect.MAVLINK_MSG_ID_BATTERY_STATUS: self.battery_status,
            dialect.MAVLINK_MSG_ID_GPS_RAW_INT: self.gps_raw_int,
            dialect.MAVLINK_MSG_ID_ESTIMATOR_STATUS: self.estimator_status,
            dialect.MAVLINK_MSG_ID_PING: self.ping,
        }

    def heartbeat(self) -> Message:
        """Return HEARTBEAT, with the mode that is active (a failsafe may have chosen it)."""
        state = self._state
        return dialect.MAVLink_heartbeat_message(
            dialect.MAV_TYPE_QUADROTOR,
            dialect.MAV_AUTOPILOT_PX4,
            base_mode(
                state.mode, armed=state.armed, attitude_controlled=self._attitude_controlled()
            ),
            custom_mode(state.mode),
            self.system_status(),
            3,
        )

    def system_status(self) -> int:
        """Return MAV_STATE with PX4's meanings: 0 not ready, 3 ready, 4 armed, 5 failsafe."""
        state = self._state
        if state.armed:
            return int(dialect.MAV_STATE_CRITICAL if state.failsafe else dialect.MAV_STATE_ACTIVE)
        return int(
            dialect.MAV_STATE_STANDBY if state.prearm_problem is None else dialect.MAV_STATE_UNINIT
        )

    def _attitude_controlled(self) -> bool:
        setpoint = self._stream.setpoint
        if isinstance(setpoint, AttitudeSetpoint):
            return setpoint.q is not None
        return setpoint is not None

    def current_mode(self) -> Message:
        """Return CURRENT_MODE, with the active mode and the mode that the user intends."""
        state = self._state
        return dialect.MAVLink_current_mode_message(
            standard_mode(state.mode), custom_mode(state.mode), custom_mode(state.intended_mode)
        )

    def sys_status(self) -> Message:
        """Return SYS_STATUS with the recorded sensors."""
        return self._sys_status(_SENSORS_PRESENT, _SENSORS_ENABLED, _SENSORS_HEALTHY, 100)

    def battery_status(self) -> Message:
        """Return BATTERY_STATUS: 0 mAh consumed, the consumed energy not provided (-1)."""
        return self._battery_status(
            dialect.MAV_BATTERY_FUNCTION_ALL, dialect.MAV_BATTERY_TYPE_LIPO, 0, -1
        )

    def gps_raw_int(self) -> Message:
        """Return GPS_RAW_INT: a 3D fix, or no fix without GPS."""
        state = self._state
        time_us = state.stamp_us
        if not state.gps_ok:
            return dialect.MAVLink_gps_raw_int_message(
                time_us, 0, 0, 0, 0, NO_VALUE, NO_VALUE, NO_VALUE, NO_VALUE, 0
            )
        return self._gps_fix(dialect.GPS_FIX_TYPE_3D_FIX, (70, 110), NO_VALUE, (900, 1780, 400))

    def estimator_status(self) -> Message:
        """Return ESTIMATOR_STATUS with the recorded flags and typical ratios."""
        state = self._state
        if not state.position_valid:
            test_ratios = (nan, nan, 0.004, 0.05, nan, nan, 14.0, 1.25)
            return dialect.MAVLink_estimator_status_message(
                state.stamp_us, _ESTIMATOR_NO_POSITION, *test_ratios
            )
        flags = _ESTIMATOR_ON_GROUND if state.landed else _ESTIMATOR_IN_AIR
        test_ratios = (0.015, 0.008, 0.004, 0.08, 0.001, nan, 0.295, 0.275)
        return dialect.MAVLink_estimator_status_message(state.stamp_us, flags, *test_ratios)

    def ping(self) -> Message:
        """Return a PING request, with a new sequence number."""
        self._next_ping += 1
        return dialect.MAVLink_ping_message(self._state.stamp_us, self._next_ping - 1, 0, 0)
