"""The position controller of the autopilot's own modes: P and PI to attitude and thrust."""

from dataclasses import dataclass, field
from math import atan2, copysign, cos, hypot, isnan, pi, sin, sqrt, tan
from typing import NamedTuple

from sitl_mock.parameters import ParameterTable
from sitl_mock.quaternion import Quaternion, Vector, normalise
from sitl_mock.state import NAN, NAN_VECTOR

GRAVITY = 9.80665


class PositionDemand(NamedTuple):
    """What to follow: position, velocity and acceleration (NED, SI; NaN = free) and yaw (rad).

    ``speed`` bounds the horizontal velocity asked by the position loop, ``down_speed`` and
    ``up_speed`` the vertical one, m/s.
    """

    position: Vector
    velocity: Vector
    acceleration: Vector = NAN_VECTOR
    yaw: float = NAN
    speed: float = 12.0
    up_speed: float = 3.0
    down_speed: float = 1.5


class PositionOutput(NamedTuple):
    """Attitude to hold, collective thrust 0..1, and the velocity and acceleration asked (NED)."""

    q: Quaternion
    thrust: float
    velocity: Vector
    acceleration: Vector


@dataclass
class PositionController:
    """PX4's multicopter position control in its plain form.

    Args:
        parameters: gains and limits, read at every step so that a PARAM_SET acts at once.
    """

    parameters: ParameterTable
    _integral: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])

    def reset(self) -> None:
        """Forget the integrals."""
        self._integral = [0.0, 0.0, 0.0]

    def step(
        self,
        demand: PositionDemand,
        position: Vector,
        velocity: Vector,
        dt: float,
    ) -> PositionOutput:
        """Return attitude and thrust for one period of ``dt`` s from the estimated state."""
        asked_velocity = self._velocity(demand, position)
        acceleration = self._acceleration(demand, asked_velocity, velocity, dt)
        return self._thrust_vector(acceleration, asked_velocity, demand.yaw)

    def _velocity(self, demand: PositionDemand, position: Vector) -> Vector:
        gains = (
            self.parameters["MPC_XY_P"],
            self.parameters["MPC_XY_P"],
            self.parameters["MPC_Z_P"],
        )
        asked = []
        for axis in range(3):
            error = demand.position[axis] - position[axis]
            wanted = demand.velocity[axis]
            if isnan(error):
                asked.append(wanted)
            else:
                asked.append(gains[axis] * error + (0.0 if isnan(wanted) else wanted))
        north, east, down = asked
        speed = hypot(north, east)
        if speed > demand.speed:
            north, east = north * demand.speed / speed, east * demand.speed / speed
        if not isnan(down):
            down = max(-demand.up_speed, min(demand.down_speed, down))
        return (north, east, down)

    def _acceleration(
        self, demand: PositionDemand, asked: Vector, velocity: Vector, dt: float
    ) -> Vector:
        parameters = self.parameters
        xy = (parameters["MPC_XY_VEL_P_ACC"], parameters["MPC_XY_VEL_I_ACC"])
        gains = (xy, xy, (parameters["MPC_Z_VEL_P_ACC"], parameters["MPC_Z_VEL_I_ACC"]))
        result = []
        for axis, (proportional, integral) in enumerate(gains):
            feed_forward = demand.acceleration[axis]
            total = 0.0 if isnan(feed_forward) else feed_forward
            error = asked[axis] - velocity[axis]
            if not isnan(error):
                grown = self._integral[axis] + integral * error * dt
                self._integral[axis] = max(-GRAVITY / 2, min(GRAVITY / 2, grown))
                total += proportional * error + self._integral[axis]
            result.append(total)
        north, east, down = result
        return (north, east, down)

    def _thrust_vector(self, acceleration: Vector, asked: Vector, yaw: float) -> PositionOutput:
        north, east, down = acceleration
        lift = max(GRAVITY - down, 0.1 * GRAVITY)
        limit = lift * tan(min(self.parameters["MPC_TILTMAX_AIR"], 80.0) * pi / 180.0)
        side = hypot(north, east)
        if side > limit:
            north, east = north * limit / side, east * limit / side
        specific = sqrt(north * north + east * east + lift * lift)
        q = _thrust_attitude((-north / specific, -east / specific, lift / specific), yaw)
        thrust = self.parameters["MPC_THR_HOVER"] * max(GRAVITY - down, 0.0) / GRAVITY
        thrust *= specific / lift
        thrust = max(self.parameters["MPC_THR_MIN"], min(self.parameters["MPC_THR_MAX"], thrust))
        return PositionOutput(q, thrust, asked, (north, east, down))


def _thrust_attitude(down_axis: Vector, yaw: float) -> Quaternion:
    """Return the attitude with this body down axis (unit, NED) and Euler yaw (rad)."""
    zx, zy, zz = down_axis
    # Tilt about a level axis, then the turn about the body axis that gives the Euler yaw.
    w = sqrt(max(0.5 * (1.0 + zz), 1e-9))
    tilt = (w, -zy / (2.0 * w), zx / (2.0 * w), 0.0)
    # Body x of (tilt ⊗ turn by h) must point along yaw: solve for h on the level plane.
    ex = (1.0 - 2.0 * tilt[2] * tilt[2], 2.0 * tilt[1] * tilt[2])
    ey = (2.0 * tilt[1] * tilt[2], 1.0 - 2.0 * tilt[1] * tilt[1])
    c, s = cos(yaw), sin(yaw)
    across_x = ex[0] * s - ex[1] * c
    across_y = ey[0] * s - ey[1] * c
    turn = atan2(-across_x, across_y)
    if (ex[0] * cos(turn) + ey[0] * sin(turn)) * c + (
        ex[1] * cos(turn) + ey[1] * sin(turn)
    ) * s < 0:
        turn += copysign(pi, -turn)
    cw, cz = cos(0.5 * turn), sin(0.5 * turn)
    tw, tx, ty, _ = tilt
    return normalise((tw * cw, tx * cw + ty * cz, ty * cw - tx * cz, tw * cz))
