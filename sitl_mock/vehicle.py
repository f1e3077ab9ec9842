"""The vehicle: rate loop, rotors, rigid body, wind, battery, ground and sensors, in fixed steps."""

from math import nan
from typing import NamedTuple

from sitl_mock.battery import Battery, BatteryState
from sitl_mock.config import (
    AirframeConfig,
    BatteryConfig,
    RateLoopConfig,
    SensorConfig,
    WindConfig,
)
from sitl_mock.ground import Ground
from sitl_mock.physics import Load, Motion, advance, body_of, derivative
from sitl_mock.quaternion import Quaternion, Vector, from_yaw
from sitl_mock.rate_loop import RateLoop
from sitl_mock.rotors import STOPPED, Four, Mix, Rotors, mix
from sitl_mock.sensors import Estimate, Estimator, Snapshot
from sitl_mock.wind import Wind

__all__ = ["ActuatorCommand", "BatteryState", "Estimate", "TruthState", "Vehicle"]

ZERO: Vector = (0.0, 0.0, 0.0)
SLOW_STEP_S = 0.01
"""Wind and battery change slowly; they move on this often."""


class ActuatorCommand(NamedTuple):
    """What the autopilot's upper layers ask of the rate loop.

    Rates in rad/s, body FRD, not clipped; NaN or infinite = hold the present rate. Thrust 0..1;
    NaN or <= 0 = none, above 1 = full.
    """

    armed: bool
    roll_rate: float
    pitch_rate: float
    yaw_rate: float
    thrust: float


class TruthState(NamedTuple):
    """What is really so. SI; world NED (origin: home on the ground), body FRD."""

    time: float  # s since boot
    position_ned: Vector
    velocity_ned: Vector
    acceleration_ned: Vector  # mean over the latest step
    q: Quaternion
    body_rates: Vector
    on_ground: bool
    crashed: bool
    touchdown_speed: float  # m/s down at the latest touchdown, NaN before the first
    rotor_thrusts: Four  # N, PX4's rotor order
    throttles: Four  # commanded to each rotor, 0..1
    wind_ned: Vector


class Vehicle:
    """One vehicle, standing at home at the time 0. Everything is a function of (config, seed).

    Args:
        airframe: body and rotors.
        rate_loop: the body-rate controller.
        wind: the air.
        battery: the pack.
        sensors: errors of the estimate.
        seed: of all noise.
        heading: at the start, rad clockwise from north.
    """

    def __init__(
        self,
        airframe: AirframeConfig | None = None,
        rate_loop: RateLoopConfig | None = None,
        wind: WindConfig | None = None,
        battery: BatteryConfig | None = None,
        sensors: SensorConfig | None = None,
        *,
        seed: int,
        heading: float = 0.0,
    ) -> None:
        airframe = airframe or AirframeConfig()
        self.steps = 0
        self._rate_hz = airframe.physics_rate_hz
        self._dt = dt = 1.0 / self._rate_hz
        self._slow_steps = round(SLOW_STEP_S * self._rate_hz)
        slow_dt = self._slow_steps * dt
        self._slow_dt = slow_dt
        self._mass = airframe.mass_kg
        per_throttle = airframe.mass_kg * airframe.thrust_slope_m_s2
        self._tilt_torque = airframe.rotor_arm_m * per_throttle  # N m per throttle difference
        self._yaw_torque = airframe.rotor_drag_ratio_m * per_throttle
        self._body = body_of(airframe)
        self._rotors = Rotors(airframe, dt)
        self._rate_loop = RateLoop(rate_loop or RateLoopConfig(), dt)
        self._wind = Wind(wind or WindConfig(), slow_dt, seed)
        self._battery = Battery(battery or BatteryConfig(), airframe)
        self._ground = Ground(airframe, dt)
        self._motion: Motion = (*ZERO, *from_yaw(heading), *ZERO)
        self._position: Vector = ZERO
        self._acceleration: Vector = ZERO
        self._angular_acceleration: Vector = ZERO
        self._mix = STOPPED
        self._touchdown_speed = nan
        self.on_ground = True
        self.crashed = False
        self._estimator = Estimator(
            sensors or SensorConfig(),
            Snapshot(self._motion, self._position, self._acceleration),
            gravity=airframe.gravity_m_s2,
            dt=dt,
            seed=seed,
        )

    @property
    def step_s(self) -> float:
        """Length of one physics step, s."""
        return self._dt

    @property
    def time(self) -> float:
        """Seconds since boot, from the count of steps."""
        return self.steps / self._rate_hz

    @property
    def truth(self) -> TruthState:
        """What is really so after the latest step."""
        vn, ve, vd, w, x, y, z, p, q, r = self._motion
        return TruthState(
            self.time,
            self._position,
            (vn, ve, vd),
            self._acceleration,
            (w, x, y, z),
            (p, q, r),
            self.on_ground,
            self.crashed,
            self._touchdown_speed,
            self._rotors.thrusts,
            self._mix.throttles,
            self._wind.velocity,
        )

    @property
    def battery(self) -> BatteryState:
        """The pack's voltage, current and charge."""
        return self._battery.state

    def set_battery_remaining(self, remaining: float) -> None:
        """Put the charge to a fraction 0..1 of the capacity."""
        self._battery.set_remaining(remaining)

    @property
    def reset_counter(self) -> int:
        """Estimator resets since boot."""
        return self._estimator.reset_counter

    def estimate(self) -> Estimate:
        """What the autopilot believes now; every call draws fresh noise."""
        return self._estimator.estimate()

    def shift_estimate(self, *, yaw: float = 0.0, position_ned: Vector = ZERO) -> None:
        """An estimator reset: the estimate jumps by this yaw (rad) and position (m)."""
        self._estimator.shift(yaw, position_ned)

    def step(self, command: ActuatorCommand) -> None:
        """One physics step of `step_s` seconds under one command."""
        if self.steps % self._slow_steps == 0:
            self._wind.step()
            self._battery.step(sum(self._rotors.thrusts), self._slow_dt)
        self._mix = self._control(command)
        thrust, torque_x, torque_y, torque_z = self._rotors.step(
            self._mix.throttles, self._battery.thrust_factor
        )
        load = (thrust / self._mass, torque_x, torque_y, torque_z, *self._wind.velocity)
        self.steps += 1
        if self.crashed:
            self._stand(self._motion[3:7])
        elif self.on_ground and derivative(self._motion, load, self._body)[2] >= 0.0:
            self._stand(self._ground.level(self._motion[3:7]))
        else:
            self.on_ground = False
            self._fly(load)
            if self._position[2] >= 0.0 and self._motion[2] > 0.0:
                self._touch_down()
        self._estimator.record(Snapshot(self._motion, self._position, self._acceleration))

    def _control(self, command: ActuatorCommand) -> Mix:
        """The rate loop and the allocation: command to throttles."""
        armed, roll, pitch, yaw, thrust = command
        setpoint = (roll, pitch, yaw)
        if self.on_ground or not armed:
            self._rate_loop.idle(setpoint)
            torques = ZERO
        else:
            torques = self._rate_loop.step(
                setpoint,
                self._motion[7:],
                self._angular_acceleration,
                tilt_saturated=self._mix.tilt_saturated,
                yaw_saturated=self._mix.yaw_saturated,
            )
        # Written so that a NaN thrust fails the comparison and stops the rotors.
        if self.crashed or not armed or not thrust > 0.0:
            return STOPPED
        return mix(
            thrust,
            torques[0] / self._tilt_torque,
            torques[1] / self._tilt_torque,
            torques[2] / self._yaw_torque,
        )

    def _fly(self, load: Load) -> None:
        before, rate_hz = self._motion, self._rate_hz
        after, moved = advance(before, load, self._body, self._dt)
        position = self._position
        self._motion = after
        self._position = (position[0] + moved[0], position[1] + moved[1], position[2] + moved[2])
        self._acceleration = (
            (after[0] - before[0]) * rate_hz,
            (after[1] - before[1]) * rate_hz,
            (after[2] - before[2]) * rate_hz,
        )
        self._angular_acceleration = (
            (after[7] - before[7]) * rate_hz,
            (after[8] - before[8]) * rate_hz,
            (after[9] - before[9]) * rate_hz,
        )

    def _stand(self, q: Quaternion) -> None:
        """One step at rest on the ground with this attitude."""
        self._motion = (*ZERO, *q, *ZERO)
        self._acceleration = ZERO
        self._angular_acceleration = ZERO

    def _touch_down(self) -> None:
        sink_speed, q = self._motion[2], self._motion[3:7]
        self._touchdown_speed = sink_speed
        self.on_ground = True
        self.crashed = not self._ground.survives(q, sink_speed)
        self._position = (self._position[0], self._position[1], 0.0)
        self._stand(q)
