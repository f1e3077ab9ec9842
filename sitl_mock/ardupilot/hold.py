"""How ArduCopter flies what is not rates: a point and a heading held, a climb rate followed."""

from math import radians, sqrt

from sitl_mock.autopilot.parameters import ParameterTable
from sitl_mock.autopilot.position_control import (
    PositionController,
    PositionDemand,
    PositionGains,
    PositionOutput,
)
from sitl_mock.autopilot.state import NAN, PositionTargetEcho, State
from sitl_mock.physics.quaternion import Vector, yaw


class ClimbProfile:
    """The height, climb rate and acceleration that are followed now; SI, up positive."""

    def __init__(self) -> None:
        self.height = 0.0
        self.rate = 0.0
        self.acceleration = 0.0

    def begin(self, height: float, rate: float) -> None:
        """Begin where the vehicle is, as fast as it climbs."""
        self.height = height
        self.rate = rate
        self.acceleration = 0.0

    def step(self, asked: float, acceleration: float, dt: float) -> None:
        """Move on by ``dt`` s towards the climb rate ``asked``."""
        most = acceleration * dt
        change = max(-most, min(most, asked - self.rate))
        self.acceleration = change / dt
        self.rate += change
        self.height += self.rate * dt


def approach_speed(way: float, acceleration: float, fastest: float) -> float:
    """Return the speed from which ``acceleration`` still stops within the ``way``, m/s."""
    return min(fastest, sqrt(2.0 * acceleration * max(0.0, way)))


STOPPING_S = 0.65
"""The point to hold lies this many seconds of velocity ahead (recorded on entering LAND)."""
_HEIGHT_INTEGRAL = 1.0
"""Acceleration per height speed error and second; the mock's own, steady in a hover."""
_STEEP_CLIMB = 10.0
"""Bounds what the height loop may ask, m/s; the climb rate has its limits already."""


class PositionHold:
    """Holds a point, a heading and a height that a climb rate moves.

    Args:
        state: the autopilot's state; the position target's echo is written here.
        parameters: gains, limits and speeds, read at every step.
    """

    def __init__(self, state: State, parameters: ParameterTable) -> None:
        self._state = state
        self._parameters = parameters
        self._controller = PositionController(self._gains)
        self.climb = ClimbProfile()
        self.point = (0.0, 0.0)
        """Held, NED, m."""
        self.yaw = 0.0
        """Held, rad."""

    def begin(self) -> None:
        """Hold from here: stop ahead, keep the heading and the climb rate as they are."""
        estimate = self._state.estimate
        x, y, z = estimate.position_ned
        vx, vy, vz = estimate.velocity_ned
        self.point = (x + STOPPING_S * vx, y + STOPPING_S * vy)
        self.yaw = yaw(estimate.q)
        self.climb.begin(-z, -vz)
        self._controller.reset()

    def shift(self, yaw_step: float, position_step: Vector) -> None:
        """Move all that is held along with an estimator reset (rad, m NED)."""
        dx, dy, dz = position_step
        self.point = (self.point[0] + dx, self.point[1] + dy)
        self.climb.height -= dz
        self.yaw += yaw_step

    def step(self, climb_rate: float, dt: float, *, level: bool = False) -> PositionOutput:
        """Return attitude and thrust of one period.

        Args:
            climb_rate: asked, m/s up.
            dt: the period, s.
            level: keep level instead of holding the point.
        """
        parameters, climb = self._parameters, self.climb
        climb.step(climb_rate, 0.01 * parameters["WPNAV_ACCEL_Z"], dt)
        north, east = (NAN, NAN) if level else self.point
        demand = PositionDemand(
            (north, east, -climb.height),
            (NAN, NAN, -climb.rate),
            (*((0.0, 0.0) if level else (NAN, NAN)), -climb.acceleration),
            self.yaw,
            0.01 * parameters["WPNAV_SPEED"],
            _STEEP_CLIMB,
            _STEEP_CLIMB,
        )
        return self.follow(demand, dt)

    def follow(self, demand: PositionDemand, dt: float) -> PositionOutput:
        """Return attitude and thrust of one period for a demand of any kind."""
        state = self._state
        estimate = state.estimate
        output = self._controller.step(demand, estimate.position_ned, estimate.velocity_ned, dt)
        state.position_target = PositionTargetEcho(
            True, demand.position, output.velocity, output.acceleration, demand.yaw
        )
        return output

    def _gains(self) -> PositionGains:
        parameters = self._parameters
        return PositionGains(
            parameters["PSC_POSXY_P"],
            parameters["PSC_POSZ_P"],
            parameters["PSC_VELXY_P"],
            parameters["PSC_VELZ_P"],
            parameters["PSC_VELXY_I"],
            _HEIGHT_INTEGRAL,
            radians(0.01 * parameters["ANGLE_MAX"]),
            parameters["MOT_THST_HOVER"],
            0.0,
            1.0,
        )
