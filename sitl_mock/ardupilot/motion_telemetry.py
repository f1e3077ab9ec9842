"""Telemetry of position and motion in ArduCopter's conventions."""

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.autopilot.motion_telemetry import MAGNETIC_FIELD_NED, Builder, MotionTelemetry
from sitl_mock.link.framing import Message
from sitl_mock.physics.rigid_body import GRAVITY

_SAME_AS_PX4 = (
    dialect.MAVLINK_MSG_ID_ATTITUDE,
    dialect.MAVLINK_MSG_ID_ATTITUDE_QUATERNION,
    dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED,
    dialect.MAVLINK_MSG_ID_ATTITUDE_TARGET,
    dialect.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED,
    dialect.MAVLINK_MSG_ID_HIGHRES_IMU,
    dialect.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW,
    dialect.MAVLINK_MSG_ID_VIBRATION,
)
"""Messages that ArduCopter builds as PX4 does; only ATTITUDE_TARGET differs if rates are shaped.
ArduCopter has no ODOMETRY and no ALTITUDE."""


class ArduPilotMotionTelemetry(MotionTelemetry):
    """Builds messages from the estimate, as ArduCopter does."""

    airspeed = 0.0

    def builders(self) -> dict[int, Builder]:
        """Return message id -> builder."""
        builders = super().builders()
        return {message_id: builders[message_id] for message_id in _SAME_AS_PX4} | {
            dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: self.position_or_zeros,
            dialect.MAVLINK_MSG_ID_VFR_HUD: self.vfr_hud,
            dialect.MAVLINK_MSG_ID_RAW_IMU: self.raw_imu,
            dialect.MAVLINK_MSG_ID_SCALED_PRESSURE: self.scaled_pressure,
        }

    def attitude_target(self) -> Message:
        """Return ATTITUDE_TARGET: the shaped target, which leads the body, and its rates."""
        shaped = self._vehicle.attitude_target
        if shaped is None:
            return super().attitude_target()
        return dialect.MAVLink_attitude_target_message(
            self._boot_ms, 0, shaped.target, *shaped.rates, self._state.attitude_target.thrust
        )

    def position_or_zeros(self) -> Message:
        """Return GLOBAL_POSITION_INT, with zeros if there is no position."""
        message = self.global_position_int()
        if message is not None:
            return message
        return dialect.MAVLink_global_position_int_message(self._boot_ms, *(0,) * 8)

    def raw_imu(self) -> Message:
        """Return RAW_IMU: mg, mrad/s, mgauss."""
        estimate = self._state.estimate
        return dialect.MAVLink_raw_imu_message(
            self._state.shown_us,
            *(round(1e3 * force / GRAVITY) for force in estimate.specific_force_frd),
            *(round(1e3 * rate) for rate in estimate.gyro),
            *(round(1e3 * field) for field in MAGNETIC_FIELD_NED),
        )

    def scaled_pressure(self) -> Message:
        """Return SCALED_PRESSURE."""
        return dialect.MAVLink_scaled_pressure_message(
            self._boot_ms, self.pressure_hpa(), 0.0, 3500
        )
