"""A multirotor in the air under rate control, without ground and sensors, for the studies."""

from sitl_mock.config.airframe import AirframeConfig
from sitl_mock.config.rate_loop import RateLoopConfig
from sitl_mock.physics.multirotor_step import (
    ZERO,
    Conditions,
    at_rest,
    drive,
    empty_rings,
    initial_actuation,
    move,
    multirotor_constants,
    steady_throttle,
)
from sitl_mock.physics.quaternion import Quaternion, Vector
from sitl_mock.physics.rigid_body import Load

_STILL_AIR = Conditions(1.0, ZERO, ZERO)


class Multirotor:
    """A multirotor with its rate loop, in fixed steps: each step is `drive`, then `move`.

    The multirotor starts at rest, with rotors at a steady speed.

    Args:
        q: attitude at the start.
        specific_thrust: specific thrust of all rotors at the start, m/s^2.

    Attributes:
        body: motion after the latest step. To stop the vehicle, assign `at_rest(q)`.
        actuation: state of controller and rotors after the latest step, its `Allocation` first.
    """

    def __init__(
        self,
        airframe: AirframeConfig,
        rate_loop: RateLoopConfig,
        q: Quaternion,
        specific_thrust: float = 0.0,
    ) -> None:
        self.constants = multirotor_constants(airframe, rate_loop)
        self.body = at_rest(q)
        self.actuation = initial_actuation(self.constants, self.throttle(specific_thrust))
        self._delay_rings = empty_rings(self.constants)
        self._steps = 0

    @property
    def dt(self) -> float:
        """Length of a step, s."""
        return self.constants.rate_loop.dt

    @property
    def q(self) -> Quaternion:
        """Attitude after the latest step."""
        return self.body[0][3:7]

    @property
    def body_rates(self) -> Vector:
        """Body rates after the latest step, rad/s, FRD."""
        return self.body[0][7:]

    def throttle(self, specific_thrust: float) -> float:
        """Return the collective throttle for a steady specific thrust (m/s^2), at most 1."""
        return steady_throttle(self.constants, specific_thrust)

    def drive(self, setpoint: Vector, throttle: float, *, controlled: bool = True) -> Load:
        """Run controller, allocation and rotors for one step in still air; return the load.

        The arguments are those of `multirotor_step.drive`.
        """
        load, self.actuation = drive(
            self.constants,
            self._delay_rings,
            self.actuation,
            self.body,
            self._steps,
            setpoint,
            throttle,
            controlled,
            _STILL_AIR,
        )
        self._steps += 1
        return load

    def move(self, load: Load) -> Vector:
        """Integrate one step under this load; return the displacement, NED, m."""
        self.body, displacement = move(self.constants, self.body, load)
        return displacement
