"""Telemetry of position and motion in ArduCopter's conventions."""

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.autopilot.motion_telemetry import Builder, MotionTelemetry
from sitl_mock.link.framing import Message
from sitl_mock.physics.rigid_body import GRAVITY


class ArduPilotMotionTelemetry(MotionTelemetry):
    """Builds messages from the estimate, as ArduCopter does."""

    airspeed = 0.0
    gauss_in_highres_imu = 1e6
    """What HIGHRES_IMU sends for 1 gauss (recorded): ArduPilot multiplies its mgauss by 1000."""

    def builders(self) -> dict[int, Builder]:
        """Return message id -> builder; ArduCopter has no ODOMETRY and no ALTITUDE."""
        builders = super().builders()
        del builders[dialect.MAVLINK_MSG_ID_ODOMETRY], builders[dialect.MAVLINK_MSG_ID_ALTITUDE]
        return builders | {
            dialect.MAVLINK_MSG_ID_RAW_IMU: self.raw_imu,
            dialect.MAVLINK_MSG_ID_SCALED_PRESSURE: self.scaled_pressure,
        }

    def attitude_target(self) -> Message:
        """Return ATTITUDE_TARGET: attitude and rates of the shaped target."""
        shaped_target = self._vehicle.attitude_target
        if shaped_target is None:
            return super().attitude_target()
        return dialect.MAVLink_attitude_target_message(
            self._boot_ms,
            0,
            shaped_target.target,
            *shaped_target.rates,
            self._state.attitude_target.thrust,
        )

    def global_position_int(self) -> Message:
        """Return GLOBAL_POSITION_INT, with zeros if there is no position."""
        zero_message = dialect.MAVLink_global_position_int_message(self._boot_ms, *(0,) * 8)
        return super().global_position_int() or zero_message

    def raw_imu(self) -> Message:
        """Return RAW_IMU in mg, mrad/s and mgauss."""
        estimate = self._state.estimate
        return dialect.MAVLink_raw_imu_message(
            self._state.stamp_us,
            *(round(1e3 * force / GRAVITY) for force in estimate.specific_force_frd),
            *(round(1e3 * rate) for rate in estimate.body_rates),
            *(round(1e3 * field) for field in self.magnetic_field()),
        )

    def scaled_pressure(self) -> Message:
        """Return SCALED_PRESSURE at the estimated height, at 35 degrees C."""
        return dialect.MAVLink_scaled_pressure_message(
            self._boot_ms, self.pressure_hpa(), 0.0, 3500
        )
