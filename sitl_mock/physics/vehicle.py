"""The vehicle: multirotor, wind, battery, ground and sensors, in fixed steps."""

from math import nan
from typing import NamedTuple

from sitl_mock.config.airframe import AirframeConfig, BatteryConfig, WindConfig
from sitl_mock.config.rate_loop import RateLoopConfig
from sitl_mock.config.sensors import SensorConfig
from sitl_mock.physics.battery import Battery, BatteryState
from sitl_mock.physics.environment import Wind, ground_constants
from sitl_mock.physics.multirotor_step import (
    ZERO,
    Conditions,
    at_rest,
    initial_actuation,
    multirotor_constants,
    steady_throttle,
)
from sitl_mock.physics.quaternion import Quaternion, Vector, from_yaw, multiply
from sitl_mock.physics.rate_shaping import ShapingState
from sitl_mock.physics.rotors import FourFloats
from sitl_mock.physics.sensors import Estimate, Estimator
from sitl_mock.physics.vehicle_step import (
    DISARMED_COMMAND,
    ActuatorCommand,
    Plant,
    PythonPlant,
    VehicleConstants,
    VehicleState,
    truth_row,
)

__all__ = [
    "DISARMED_COMMAND",
    "ActuatorCommand",
    "BatteryState",
    "Estimate",
    "TruthState",
    "Vehicle",
]

SLOW_STEP_S = 0.01
"""Step of wind and battery, which change slowly, s."""


class TruthState(NamedTuple):
    """The true state. SI; world NED (origin: position at boot), body FRD."""

    time: float  # s since boot
    position_ned: Vector
    velocity_ned: Vector
    acceleration_ned: Vector  # mean over the latest step
    q: Quaternion
    body_rates: Vector
    on_ground: bool
    crashed: bool
    touchdown_speed: float  # m/s down at the latest touchdown, NaN before the first
    rotor_thrusts: FourFloats  # N, PX4's rotor order
    throttles: FourFloats  # commanded to each rotor, 0..1


class Vehicle:
    """One vehicle, on the ground at time 0; settings, seed and commands determine its motion.

    Args:
        heading: heading at the start, rad clockwise from north.
        plant: computes steps and estimates: `PythonPlant`, or `compiled.CompiledPlant`.

    Attributes:
        steps: physics steps since boot.
        on_ground: whether the vehicle stands on the ground.
        crashed: whether a touchdown was a crash.
        estimator: errors of the estimate.
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
        plant: type[Plant] = PythonPlant,
    ) -> None:
        airframe = airframe or AirframeConfig()
        self.steps = 0
        self.on_ground, self.crashed = True, False
        self._thrust = 0.0  # of all rotors, N
        self._rate_hz = airframe.physics_rate_hz
        self._multirotor = multirotor_constants(airframe, rate_loop or RateLoopConfig())
        dt = self._multirotor.rate_loop.dt
        self._slow_steps = round(SLOW_STEP_S * self._rate_hz)
        self._slow_dt = self._slow_steps * dt
        self._wind = Wind(wind or WindConfig(), self._slow_dt, seed)
        self._battery = Battery(battery or BatteryConfig(), airframe)
        body, actuation = at_rest(from_yaw(heading)), initial_actuation(self._multirotor, 0.0)
        self.estimator = Estimator(
            sensors or SensorConfig(),
            truth_row(body, ZERO),
            gravity=airframe.gravity_m_s2,
            dt=dt,
            seed=seed,
            make_noise=plant.make_noise,
        )
        self.plant = plant(
            VehicleConstants(self._multirotor, ground_constants(airframe, dt)),
            VehicleState(0, body, actuation, ZERO, True, False, nan),
            self.estimator.history_length,
        )

    @property
    def time(self) -> float:
        """Seconds since boot, from the count of steps."""
        return self.steps / self._rate_hz

    @property
    def truth(self) -> TruthState:
        """The true state after the latest step."""
        _, body, actuation, position, on_ground, crashed, touchdown_speed = self.plant.state
        motion, acceleration, _ = body
        allocation, thrusts, _, _ = actuation
        vn, ve, vd, w, x, y, z, p, q, r = motion
        return TruthState(
            self.time,
            position,
            (vn, ve, vd),
            acceleration,
            (w, x, y, z),
            (p, q, r),
            on_ground,
            crashed,
            touchdown_speed,
            thrusts,
            allocation.throttles,
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
        return steady_throttle(self._multirotor, specific_thrust)

    def estimate(self) -> Estimate:
        """Return the autopilot's present estimate; every call draws new noise."""
        estimator, time = self.estimator, self.time
        estimator.correct(time, self.plant.truth_ago)
        estimate, estimator.attitude_error = self.plant.estimate(
            estimator.constants, estimator.state, time, estimator.draw_noise()
        )
        return estimate

    @property
    def attitude_target(self) -> ShapingState | None:
        """ArduPilot's shaped rates and attitude target; None if rates are not shaped now.

        The attitude target is in the frame of the estimate, with all resets of its heading.
        """
        *_, shaping = self.plant.state.actuation
        if not shaping.active:
            return None
        rotation = self.estimator.state.reset_rotation
        return shaping._replace(target=multiply(rotation, shaping.target))

    def step(self, command: ActuatorCommand, count: int = 1) -> None:
        """Advance by `count` physics steps under one command."""
        while count > 0:
            since_slow_step = self.steps % self._slow_steps
            if since_slow_step == 0:
                self._wind.step()
                self._battery.step(self._thrust, self._slow_dt)
            steps = min(count, self._slow_steps - since_slow_step)
            conditions = Conditions(
                self._battery.thrust_factor, self._wind.velocity, self.estimator.attitude_error
            )
            outcome = self.plant.advance(command, conditions, steps)
            self.on_ground, self.crashed, self._thrust = outcome
            self.steps += steps
            count -= steps
