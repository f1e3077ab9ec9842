"""Position hold: holds a point and a heading, and follows a climb rate."""

from math import nan, radians, sqrt

from sitl_mock.autopilot.attitude_control import body_z
from sitl_mock.autopilot.parameters import ParameterTable
from sitl_mock.autopilot.position_control import (
    PositionController,
    PositionDemand,
    PositionGains,
    PositionOutput,
)
from sitl_mock.autopilot.state import PositionTarget, State
from sitl_mock.physics.quaternion import Quaternion, Vector, yaw
from sitl_mock.physics.rigid_body import GRAVITY

STOPPING_S = 0.65
"""Ratio of stopping distance to speed when a hold begins, s (recorded on entering LAND)."""
_CLIMB_RATE_INTEGRAL_GAIN = 1.0
"""Integral gain of the climb rate, 1/s^2; chosen for a steady hover, not measured."""
_MAX_CLIMB_RATE = 10.0
"""Largest climb rate and sink rate of the height controller, m/s. The limit is high, because the
callers limit the climb rate that they request."""

_MIN_COS_TILT = 0.3
"""Lower bound of cos(tilt) (73 degrees), so that the acceleration by the tilt stays bounded."""


class ClimbProfile:
    """Setpoints of height, climb rate and (limited) acceleration; SI, up positive."""

    def __init__(self) -> None:
        self.height = 0.0
        self.rate = 0.0
        self.acceleration = 0.0

    def begin(self, height: float, rate: float) -> None:
        """Start at the present height and climb rate."""
        self.height = height
        self.rate = rate
        self.acceleration = 0.0

    def step(self, climb_rate: float, acceleration: float, dt: float) -> None:
        """Advance by ``dt`` s towards a climb rate, with at most ``acceleration``, m/s^2."""
        max_change = acceleration * dt
        change = max(-max_change, min(max_change, climb_rate - self.rate))
        self.acceleration = change / dt
        self.rate += change
        self.height += self.rate * dt


def approach_speed(distance: float, deceleration: float, max_speed: float) -> float:
    """Return the largest speed that can stop within the distance, at most ``max_speed``, m/s."""
    return min(max_speed, sqrt(2.0 * deceleration * max(0.0, distance)))


def lean_acceleration(q: Quaternion) -> tuple[float, float]:
    """Return the acceleration (north, east, m/s^2) of a vehicle that holds its height at ``q``."""
    north, east, down = body_z(q)
    cos_tilt_over_gravity = max(down, _MIN_COS_TILT) / GRAVITY
    return (-north / cos_tilt_over_gravity, -east / cos_tilt_over_gravity)


class PositionHold:
    """Holds a point and a heading, and follows a climb rate.

    Args:
        state: the autopilot's state; its ``position_target`` is written here.
        parameters: gains, limits and speeds, read at every step.
    """

    def __init__(self, state: State, parameters: ParameterTable) -> None:
        self._state = state
        self._parameters = parameters
        self._controller = PositionController(self._gains)
        self.climb_profile = ClimbProfile()
        self.position_ne = (0.0, 0.0)
        """North and east of the held point, m."""
        self.yaw = 0.0
        """Held heading, rad."""

    def begin(self) -> None:
        """Start a hold at the point where the vehicle can stop, with its present heading."""
        estimate = self._state.estimate
        x, y, z = estimate.position_ned
        vx, vy, vz = estimate.velocity_ned
        self.position_ne = (x + STOPPING_S * vx, y + STOPPING_S * vy)
        self.yaw = yaw(estimate.q)
        self.climb_profile.begin(-z, -vz)
        # The integrals start at the lean against the wind: a real vehicle drifts by only 0.03 m.
        self._controller.reset((0.0, 0.0) if self._state.landed else lean_acceleration(estimate.q))

    def shift(self, yaw_step: float, position_step: Vector) -> None:
        """Move the held heading (rad) and position (m, NED) by the jumps of an estimator reset."""
        dx, dy, dz = position_step
        self.position_ne = (self.position_ne[0] + dx, self.position_ne[1] + dy)
        self.climb_profile.height -= dz
        self.yaw += yaw_step

    def step(self, climb_rate: float, dt: float, *, level: bool = False) -> PositionOutput:
        """Return attitude and thrust of one period of `dt` s, at a climb rate, m/s up.

        With ``level`` the vehicle keeps level instead of holding the point.
        """
        parameters, profile = self._parameters, self.climb_profile
        profile.step(climb_rate, 0.01 * parameters["WPNAV_ACCEL_Z"], dt)
        north, east = (nan, nan) if level else self.position_ne
        demand = PositionDemand(
            (north, east, -profile.height),
            (nan, nan, -profile.rate),
            (*((0.0, 0.0) if level else (nan, nan)), -profile.acceleration),
            self.yaw,
            0.01 * parameters["WPNAV_SPEED"],
            _MAX_CLIMB_RATE,
            _MAX_CLIMB_RATE,
        )
        return self.follow(demand, dt)

    def follow(self, demand: PositionDemand, dt: float) -> PositionOutput:
        """Return attitude and thrust of one period of ``dt`` s for a position demand."""
        state = self._state
        estimate = state.estimate
        output = self._controller.step(demand, estimate.position_ned, estimate.velocity_ned, dt)
        state.position_target = PositionTarget(
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
            _CLIMB_RATE_INTEGRAL_GAIN,
            radians(0.01 * parameters["ANGLE_MAX"]),
            parameters["MOT_THST_HOVER"],
            0.0,
            1.0,
        )
