"""The vehicle: multirotor, wind, battery, ground and sensors, in fixed steps."""

from math import nan
from typing import NamedTuple

from sitl_mock.config.airframe import AirframeConfig, BatteryConfig, WindConfig
from sitl_mock.config.rate_loop import RateLoopConfig
from sitl_mock.config.sensors import SensorConfig
from sitl_mock.physics.battery import Battery, BatteryState
from sitl_mock.physics.environment import Ground, Wind
from sitl_mock.physics.multirotor import ZERO, Multirotor
from sitl_mock.physics.navigation_filter import Snapshot
from sitl_mock.physics.quaternion import Quaternion, Vector, from_yaw
from sitl_mock.physics.rate_shaping import Shaped
from sitl_mock.physics.rigid_body import Load
from sitl_mock.physics.rotors import Four
from sitl_mock.physics.sensors import Estimate, Estimator

__all__ = ["ActuatorCommand", "BatteryState", "Estimate", "TruthState", "Vehicle"]

SLOW_STEP_S = 0.01
"""Step of wind and battery, which change slowly."""


class ActuatorCommand(NamedTuple):
    """Setpoint of the rate loop and the rotors.

    Rates in rad/s, body FRD, without limit; NaN = hold the present rate. Infinity also holds it in
    PX4's rate loop; in ArduPilot's the rate grows without limit. Thrust 0..1; NaN or <= 0 = none,
    above 1 = full.
    """

    armed: bool
    roll_rate: float
    pitch_rate: float
    yaw_rate: float
    thrust: float


class TruthState(NamedTuple):
    """The true state. SI; world NED (origin: home on the ground), body FRD."""

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
    """One vehicle, on the ground at home at time 0; settings and seed determine its motion.

    Args:
        airframe: body and rotors.
        rate_loop: the body-rate controller.
        wind: steady wind and gusts.
        battery: capacity and voltages.
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
        self._multirotor = Multirotor(airframe, rate_loop or RateLoopConfig(), from_yaw(heading))
        dt = self._multirotor.dt
        self._slow_steps = round(SLOW_STEP_S * self._rate_hz)
        self._slow_dt = self._slow_steps * dt
        self._wind = Wind(wind or WindConfig(), self._slow_dt, seed)
        self._battery = Battery(battery or BatteryConfig(), airframe)
        self._ground = Ground(airframe, dt)
        self._position: Vector = ZERO
        self._touchdown_speed = nan
        self.on_ground = True
        self.crashed = False
        self._estimator = Estimator(
            sensors or SensorConfig(),
            self._snapshot(),
            gravity=airframe.gravity_m_s2,
            dt=dt,
            seed=seed,
        )

    @property
    def step_s(self) -> float:
        """Length of one physics step, s."""
        return self._multirotor.dt

    @property
    def time(self) -> float:
        """Seconds since boot, from the count of steps."""
        return self.steps / self._rate_hz

    @property
    def truth(self) -> TruthState:
        """The true state after the latest step."""
        multirotor = self._multirotor
        vn, ve, vd, w, x, y, z, p, q, r = multirotor.motion
        return TruthState(
            self.time,
            self._position,
            (vn, ve, vd),
            multirotor.acceleration,
            (w, x, y, z),
            (p, q, r),
            self.on_ground,
            self.crashed,
            self._touchdown_speed,
            multirotor.rotors.thrusts,
            multirotor.mix.throttles,
            self._wind.velocity,
        )

    @property
    def battery(self) -> BatteryState:
        """Voltage, current and charge of the battery."""
        return self._battery.state

    def set_battery_remaining(self, remaining: float) -> None:
        """Set the charge to a fraction 0..1 of the capacity."""
        self._battery.set_remaining(remaining)

    def throttle(self, specific_thrust: float) -> float:
        """Return the collective throttle for a steady specific thrust (m/s^2), at most 1."""
        return self._multirotor.throttle(specific_thrust)

    @property
    def reset_counter(self) -> int:
        """Estimator resets since boot."""
        return self._estimator.reset_counter

    def estimate(self) -> Estimate:
        """Return the autopilot's estimate now; every call draws fresh noise."""
        return self._estimator.estimate(self.time)

    @property
    def attitude_target(self) -> Shaped | None:
        """The shaped attitude target, with the error of the estimate; None if not shaped."""
        shaped = self._multirotor.shaped
        if shaped is None:
            return None
        return shaped._replace(target=self._estimator.as_estimated(shaped.target))

    def shift_estimate(self, *, yaw: float = 0.0, position_ned: Vector = ZERO) -> None:
        """Reset the estimator: the estimate jumps by this yaw (rad) and position (m)."""
        self._estimator.shift(yaw, position_ned)

    def step(self, command: ActuatorCommand) -> None:
        """Advance by one physics step of `step_s` seconds."""
        multirotor = self._multirotor
        if self.steps % self._slow_steps == 0:
            self._wind.step()
            self._battery.step(sum(multirotor.rotors.thrusts), self._slow_dt)
        armed, roll, pitch, yaw, thrust = command
        load = multirotor.drive(
            (roll, pitch, yaw),
            thrust if armed and not self.crashed else 0.0,
            controlled=armed and not self.on_ground,
            thrust_factor=self._battery.thrust_factor,
            wind=self._wind.velocity,
        )
        self.steps += 1
        if self.crashed:
            multirotor.rest(multirotor.q)
        elif self.on_ground and multirotor.sinks(load):
            multirotor.rest(self._ground.level(multirotor.q))
        else:
            self.on_ground = False
            self._fly(load)
        self._estimator.record(self._snapshot())

    def _fly(self, load: Load) -> None:
        multirotor, position = self._multirotor, self._position
        moved = multirotor.move(load)
        self._position = (position[0] + moved[0], position[1] + moved[1], position[2] + moved[2])
        if self._position[2] >= 0.0 and multirotor.motion[2] > 0.0:
            self._touch_down()

    def _touch_down(self) -> None:
        multirotor = self._multirotor
        sink_speed = multirotor.motion[2]
        self._touchdown_speed = sink_speed
        self.on_ground = True
        self.crashed = not self._ground.survives(multirotor.q, sink_speed)
        self._position = (self._position[0], self._position[1], 0.0)
        multirotor.rest(multirotor.q)

    def _snapshot(self) -> Snapshot:
        multirotor = self._multirotor
        return Snapshot(multirotor.motion, self._position, multirotor.acceleration)
