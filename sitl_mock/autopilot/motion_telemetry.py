"""Telemetry of position and motion; the defaults follow PX4's conventions."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import degrees, hypot, isnan, nan

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.autopilot.setpoints import (
    ACCELERATION_BITS,
    POSITION_BITS,
    VELOCITY_BITS,
    YAW_IGNORED,
)
from sitl_mock.autopilot.stamp_slips import StampSlips
from sitl_mock.autopilot.state import PositionTarget, State
from sitl_mock.link.framing import Message
from sitl_mock.physics.geodesy import Geodetic, to_geodetic
from sitl_mock.physics.quaternion import Vector, euler, to_body, yaw
from sitl_mock.physics.vehicle import Vehicle

Builder = Callable[[], Message | None]
"""Builds a message; returns None when it has nothing valid."""
_SEA_LEVEL_HPA = 1013.25
_MAGNETIC_FIELD_NED = (0.21, 0.01, 0.42)  # gauss
# Variances sent in ODOMETRY: m^2 and rad^2, (m/s)^2 and (rad/s)^2.
_POSE_VARIANCES = (0.041, 0.041, 0.074, 3.3e-4, 3.5e-4, 5.9e-3)
_VELOCITY_VARIANCES = (0.0095, 0.0086, 0.0052, 0.0, 0.0, 0.0)


@dataclass(eq=False)
class MotionTelemetry:
    """Builds messages from the estimate."""

    _state: State
    _vehicle: Vehicle
    """The simulated vehicle; its rotors, its reset counter and (for ArduPilot) its shaped attitude
    target are reported."""
    _origin: Geodetic
    _slips: StampSlips
    """Lag of the time stamp of LOCAL_POSITION_NED behind the true time."""

    airspeed = nan
    """Airspeed in VFR_HUD, m/s; NaN because there is no airspeed sensor."""
    gauss_in_highres_imu = 1.0
    """What HIGHRES_IMU sends for 1 gauss."""

    def builders(self) -> dict[int, Builder]:
        """Return message id -> builder."""
        return {
            dialect.MAVLINK_MSG_ID_ATTITUDE: self.attitude,
            dialect.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: self.attitude_quaternion,
            dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED: self.local_position_ned,
            dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: self.global_position_int,
            dialect.MAVLINK_MSG_ID_ODOMETRY: self.odometry,
            dialect.MAVLINK_MSG_ID_ATTITUDE_TARGET: self.attitude_target,
            dialect.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED: self.position_target_local_ned,
            dialect.MAVLINK_MSG_ID_HIGHRES_IMU: self.highres_imu,
            dialect.MAVLINK_MSG_ID_VFR_HUD: self.vfr_hud,
            dialect.MAVLINK_MSG_ID_ALTITUDE: self.altitude,
            dialect.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: self.servo_output_raw,
            dialect.MAVLINK_MSG_ID_VIBRATION: self.vibration,
        }

    @property
    def _boot_ms(self) -> int:
        return self._state.stamp_us // 1000

    @property
    def _altitude(self) -> float:
        """Estimated altitude above mean sea level, m."""
        return self._origin.altitude_m - self._state.estimate.position_ned[2]

    def attitude(self) -> Message:
        """Return ATTITUDE, with the estimated attitude and body rates."""
        estimate = self._state.estimate
        roll, pitch, heading = euler(estimate.q)
        return dialect.MAVLink_attitude_message(
            self._boot_ms, roll, pitch, heading, *estimate.body_rates
        )

    def attitude_quaternion(self) -> Message:
        """Return ATTITUDE_QUATERNION, with the estimated attitude and body rates."""
        estimate = self._state.estimate
        return dialect.MAVLink_attitude_quaternion_message(
            self._boot_ms, *estimate.q, *estimate.body_rates
        )

    def local_position_ned(self) -> Message | None:
        """Return LOCAL_POSITION_NED, None without a valid position."""
        if not self._state.position_valid:
            return None
        estimate = self._state.estimate
        return dialect.MAVLink_local_position_ned_message(
            self._boot_ms - self._slips.lag_ms(self._state.stamp_us),
            *estimate.position_ned,
            *estimate.velocity_ned,
        )

    def global_position_int(self) -> Message | None:
        """Return GLOBAL_POSITION_INT, None without a valid position."""
        state = self._state
        if not state.position_valid:
            return None
        vx, vy, vz = state.estimate.velocity_ned
        height = state.home_ned[2] - state.estimate.position_ned[2]
        return dialect.MAVLink_global_position_int_message(
            self._boot_ms,
            *to_geodetic(self._origin, state.estimate.position_ned).as_integers(),
            round(height * 1e3),
            clip(vx * 100, 15),
            clip(vy * 100, 15),
            clip(vz * 100, 15),
            round(self._heading_deg() * 100) % 36000,
        )

    def odometry(self) -> Message:
        """Return ODOMETRY; velocity is in the local frame, as PX4 sends it."""
        estimate = self._state.estimate
        return dialect.MAVLink_odometry_message(
            self._state.stamp_us,
            dialect.MAV_FRAME_LOCAL_NED,
            dialect.MAV_FRAME_LOCAL_NED,
            *estimate.position_ned,
            estimate.q,
            *estimate.velocity_ned,
            *estimate.body_rates,
            _POSE_COVARIANCE,
            _VELOCITY_COVARIANCE,
            self._vehicle.estimator.reset_counter & 0xFF,
            dialect.MAV_ESTIMATOR_TYPE_AUTOPILOT,
            100,
        )

    def attitude_target(self) -> Message:
        """Return ATTITUDE_TARGET, the setpoint of the attitude and rate controllers."""
        target = self._state.attitude_target
        return dialect.MAVLink_attitude_target_message(
            self._boot_ms, 0, target.q, *target.rates, target.thrust
        )

    def position_target_local_ned(self) -> Message | None:
        """Return POSITION_TARGET_LOCAL_NED, None unless a position controller runs."""
        target = self._state.position_target
        if not target.active:
            return None
        return dialect.MAVLink_position_target_local_ned_message(
            self._boot_ms,
            dialect.MAV_FRAME_LOCAL_NED,
            _type_mask(target),
            *target.position,
            *target.velocity,
            *target.acceleration,
            target.yaw,
            0.0,
        )

    def magnetic_field(self) -> Vector:
        """Return the magnetic field along the body axes (FRD), gauss."""
        return to_body(self._vehicle.truth.q, _MAGNETIC_FIELD_NED)

    def highres_imu(self) -> Message:
        """Return HIGHRES_IMU."""
        estimate = self._state.estimate
        return dialect.MAVLink_highres_imu_message(
            self._state.stamp_us,
            *estimate.specific_force_frd,
            *estimate.body_rates,
            *(self.gauss_in_highres_imu * field for field in self.magnetic_field()),
            self.pressure_hpa(),
            0.0,
            self._altitude,
            15.0,
            63,
        )

    def pressure_hpa(self) -> float:
        """Return the air pressure at the estimated altitude, hPa (ICAO standard atmosphere)."""
        return float(_SEA_LEVEL_HPA * (1.0 - 2.25577e-5 * self._altitude) ** 5.25588)

    def vfr_hud(self) -> Message:
        """Return VFR_HUD; the groundspeed is horizontal."""
        state = self._state
        vx, vy, vz = state.estimate.velocity_ned
        thrust = state.attitude_target.thrust
        percent = 0 if isnan(thrust) else round(100 * max(0.0, min(1.0, thrust)))
        return dialect.MAVLink_vfr_hud_message(
            self.airspeed, hypot(vx, vy), int(self._heading_deg()), percent, self._altitude, -vz
        )

    def altitude(self) -> Message:
        """Return ALTITUDE; the terrain height is the estimated height minus the true clearance."""
        state = self._state
        up, altitude = -state.estimate.position_ned[2], self._altitude
        clearance = -self._vehicle.truth.position_ned[2]
        terrain, relative = up - clearance, up + state.home_ned[2]
        return dialect.MAVLink_altitude_message(
            state.stamp_us, altitude, altitude, up, relative, terrain, clearance
        )

    def servo_output_raw(self) -> Message:
        """Return SERVO_OUTPUT_RAW: 900 us disarmed, 1000..2000 us armed, in PX4's rotor order."""
        state = self._state
        outputs = [900] * 16
        if state.armed:
            throttles = self._vehicle.truth.throttles
            outputs[: len(throttles)] = [1000 + round(1000 * throttle) for throttle in throttles]
        return dialect.MAVLink_servo_output_raw_message(state.stamp_us & 0xFFFFFFFF, 0, *outputs)

    def vibration(self) -> Message:
        """Return VIBRATION; the simulated airframe does not vibrate."""
        return dialect.MAVLink_vibration_message(self._state.stamp_us, 0.0, 0.01, 0.11, 0, 0, 0)

    def _heading_deg(self) -> float:
        return degrees(yaw(self._state.estimate.q)) % 360.0


def _type_mask(target: PositionTarget) -> int:
    """Return the POSITION_TARGET_TYPEMASK of the components that are not controlled."""
    bits = (*POSITION_BITS, *VELOCITY_BITS, *ACCELERATION_BITS, YAW_IGNORED)
    values = (*target.position, *target.velocity, *target.acceleration, target.yaw)
    return sum(bit for bit, value in zip(bits, values, strict=True) if isnan(value))


def upper_triangle(variances: Sequence[float]) -> tuple[float, ...]:
    """Return the upper triangle of a diagonal matrix, row by row, as MAVLink sends covariances."""
    size = len(variances)
    return tuple(
        variances[row] if column == row else 0.0
        for row in range(size)
        for column in range(row, size)
    )


_POSE_COVARIANCE = upper_triangle(_POSE_VARIANCES)
_VELOCITY_COVARIANCE = upper_triangle(_VELOCITY_VARIANCES)


def clip(value: float, bits: int) -> int:
    """Return the value rounded and limited to ±(2**bits - 1)."""
    limit = (1 << bits) - 1
    return max(-limit, min(limit, round(value)))
