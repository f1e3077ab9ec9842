"""A multirotor in the air under rate control: rate loop, allocation, rotors and rigid body.

`Vehicle` adds ground, battery, wind and sensors. The studies use the multirotor alone.
"""

from sitl_mock.config.airframe import AirframeConfig
from sitl_mock.config.rate_loop import RateLoopConfig
from sitl_mock.physics.quaternion import Quaternion, Vector
from sitl_mock.physics.rate_loop import RateLoop
from sitl_mock.physics.rate_shaping import RateShaping, Shaped
from sitl_mock.physics.rigid_body import Load, Motion, advance, body_of, derivative
from sitl_mock.physics.rotors import STOPPED, Mix, Rotors, mix

ZERO: Vector = (0.0, 0.0, 0.0)


class Multirotor:
    """The inner loop in fixed steps: each step is `drive`, then `move` or `rest`.

    It starts at rest, with rotors at a steady speed.

    Args:
        airframe: body and rotors.
        rate_loop: the body-rate controller.
        q: attitude at the start.
        specific_thrust: of all rotors at the start, m/s^2.

    Attributes:
        dt: length of a step, s.
        motion: velocity (NED), attitude and body rates (FRD) after the latest step.
        acceleration: NED, m/s^2, mean over the latest step.
        angular_acceleration: FRD, rad/s^2, mean over the latest step.
        mix: throttles of the latest step, and which torques saturated.
        rotors: the four rotors.
    """

    __slots__ = (
        "_body",
        "_mass",
        "_rate_hz",
        "_rate_loop",
        "_shaping",
        "_tilt_torque",
        "_yaw_torque",
        "acceleration",
        "angular_acceleration",
        "dt",
        "mix",
        "motion",
        "rotors",
    )

    motion: Motion
    acceleration: Vector
    angular_acceleration: Vector

    def __init__(
        self,
        airframe: AirframeConfig,
        rate_loop: RateLoopConfig,
        q: Quaternion,
        specific_thrust: float = 0.0,
    ) -> None:
        self._rate_hz = airframe.physics_rate_hz
        self.dt = 1.0 / self._rate_hz
        self._mass = airframe.mass_kg
        per_throttle = airframe.mass_kg * airframe.thrust_slope_m_s2
        self._tilt_torque = airframe.rotor_arm_m * per_throttle  # N m per throttle difference
        self._yaw_torque = airframe.rotor_drag_ratio_m * per_throttle
        self._body = body_of(airframe)
        shaping = rate_loop.shaping
        self._shaping = None if shaping is None else RateShaping(shaping, self.dt)
        self._rate_loop = RateLoop(rate_loop, self.dt)
        self.rotors = Rotors(airframe, self.dt)
        throttle = self.throttle(specific_thrust)
        self.mix: Mix = mix(throttle, *ZERO)
        thrust = self.rotors.steady(throttle)
        self.rotors.thrusts = (thrust, thrust, thrust, thrust)
        self.rest(q)

    @property
    def q(self) -> Quaternion:
        """Attitude after the latest step."""
        return self.motion[3:7]

    @property
    def body_rates(self) -> Vector:
        """Body rates after the latest step, rad/s, FRD."""
        return self.motion[7:]

    @property
    def shaped(self) -> Shaped | None:
        """The shaped attitude target; None if rates are not shaped, or not controlled now."""
        return None if self._shaping is None else self._shaping.shaped

    def throttle(self, specific_thrust: float) -> float:
        """Return the collective throttle for a steady specific thrust (m/s^2), at most 1."""
        return self.rotors.throttle(0.25 * self._mass * specific_thrust)

    def drive(
        self,
        setpoint: Vector,
        throttle: float,
        *,
        controlled: bool = True,
        thrust_factor: float = 1.0,
        wind: Vector = ZERO,
    ) -> Load:
        """Run controller, allocation and rotors for one step; return the load on the body.

        Args:
            setpoint: body rates, rad/s, FRD; NaN holds the present rate. Infinity holds it too,
                but if the rate loop shapes its setpoints, the rate then grows without limit.
            throttle: collective; NaN or <= 0 stops the rotors, values above 1 mean 1.
            controlled: whether the rate loop runs; otherwise it idles.
            thrust_factor: factor of the battery voltage on the thrust of every rotor.
            wind: velocity of the air, NED, m/s.
        """
        if controlled:
            if self._shaping is not None:
                setpoint = self._shaping.step(setpoint, self.motion[3:7])
            torques = self._rate_loop.step(
                setpoint,
                self.motion[7:],
                self.angular_acceleration,
                tilt_saturated=self.mix.tilt_saturated,
                yaw_saturated=self.mix.yaw_saturated,
            )
        else:
            if self._shaping is not None:
                self._shaping.idle(setpoint)
            self._rate_loop.idle(setpoint)
            torques = ZERO
        # A NaN throttle fails this comparison, which stops the rotors.
        if throttle > 0.0:
            self.mix = mix(
                throttle,
                torques[0] / self._tilt_torque,
                torques[1] / self._tilt_torque,
                torques[2] / self._yaw_torque,
            )
        else:
            self.mix = STOPPED
        thrust, torque_x, torque_y, torque_z = self.rotors.step(self.mix.throttles, thrust_factor)
        wind_n, wind_e, wind_d = wind
        return (thrust / self._mass, torque_x, torque_y, torque_z, wind_n, wind_e, wind_d)

    def sinks(self, load: Load) -> bool:
        """Whether the vertical acceleration under this load is not upward."""
        return derivative(*self.motion, load, self._body)[2] >= 0.0

    def move(self, load: Load) -> Vector:
        """Integrate one step under this load; return the displacement, NED, m."""
        vn, ve, vd, _, _, _, _, p, q, r = self.motion
        self.motion, moved = advance(self.motion, load, self._body, self.dt)
        new_vn, new_ve, new_vd, _, _, _, _, new_p, new_q, new_r = self.motion
        rate_hz = self._rate_hz
        self.acceleration = (
            (new_vn - vn) * rate_hz,
            (new_ve - ve) * rate_hz,
            (new_vd - vd) * rate_hz,
        )
        self.angular_acceleration = (
            (new_p - p) * rate_hz,
            (new_q - q) * rate_hz,
            (new_r - r) * rate_hz,
        )
        return moved

    def rest(self, q: Quaternion) -> None:
        """Set the body at rest with this attitude."""
        self.motion = (*ZERO, *q, *ZERO)
        self.acceleration = ZERO
        self.angular_acceleration = ZERO
