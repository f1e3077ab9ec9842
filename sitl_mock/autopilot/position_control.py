"""Position controller of the autopilot's own modes: P on position, PI on velocity."""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import atan2, copysign, cos, hypot, isnan, nan, pi, radians, sin, sqrt, tan
from typing import NamedTuple

from sitl_mock.autopilot.setpoints import PositionSetpoint
from sitl_mock.autopilot.state import NAN_VECTOR
from sitl_mock.physics.quaternion import Quaternion, Vector, heading_to_ned, normalise
from sitl_mock.physics.rigid_body import GRAVITY

_MAX_TILT = radians(80.0)
"""Upper bound of the tilt limit, rad."""


class PositionDemand(NamedTuple):
    """Setpoint: position, velocity, acceleration (NED, SI; NaN = not controlled) and yaw (rad).

    The yaw must be finite. ``max_speed`` limits the horizontal velocity setpoint, ``max_up_speed``
    and ``max_down_speed`` the vertical one, m/s.
    """

    position: Vector
    velocity: Vector
    acceleration: Vector = NAN_VECTOR
    yaw: float = nan
    max_speed: float = 12.0
    max_up_speed: float = 3.0
    max_down_speed: float = 1.5


def setpoint_demand(
    setpoint: PositionSetpoint, q: Quaternion, yaw: float, speed_limits: Vector, dt: float
) -> PositionDemand:
    """Return the demand of an offboard setpoint for the next ``dt`` s.

    Args:
        setpoint: the setpoint. If it has no yaw, its yaw rate changes ``yaw``.
        q: present attitude, for a setpoint relative to the heading (``in_body_heading``).
        yaw: yaw of the previous demand, rad.
        speed_limits: limits of the speed: horizontal, up, down, m/s.
        dt: the period, s.
    """
    if not isnan(setpoint.yaw):
        yaw = setpoint.yaw
    elif not isnan(setpoint.yaw_rate):
        yaw += setpoint.yaw_rate * dt
    velocity, acceleration = setpoint.velocity, setpoint.acceleration
    if setpoint.in_body_heading:
        velocity, acceleration = heading_to_ned(q, velocity), heading_to_ned(q, acceleration)
    return PositionDemand(setpoint.position, velocity, acceleration, yaw, *speed_limits)


class PositionOutput(NamedTuple):
    """Attitude, thrust 0..1, and setpoints of velocity, m/s, and acceleration, m/s^2 (NED)."""

    q: Quaternion
    thrust: float
    velocity: Vector
    acceleration: Vector


class PositionGains(NamedTuple):
    """Gains (1/s; integral gains 1/s^2), tilt limit (rad) and normalised thrusts (0..1)."""

    horizontal_position: float  # velocity per position error, 1/s
    vertical_position: float
    horizontal_velocity: float  # acceleration per velocity error, 1/s
    vertical_velocity: float
    horizontal_integral: float  # acceleration per velocity error and second, 1/s^2
    vertical_integral: float
    max_tilt: float  # rad
    hover_thrust: float
    min_thrust: float
    max_thrust: float


@dataclass
class PositionController:
    """P on position, PI on velocity, then attitude and thrust.

    Args:
        gains: called at every step, so a PARAM_SET takes effect at once.
    """

    gains: Callable[[], PositionGains]
    _integral: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])

    def reset(self, acceleration: tuple[float, float] = (0.0, 0.0)) -> None:
        """Start the horizontal integrals at an acceleration (NED, m/s^2), the vertical one at 0."""
        self._integral = [*acceleration, 0.0]

    def step(
        self, demand: PositionDemand, position: Vector, velocity: Vector, dt: float
    ) -> PositionOutput:
        """Return attitude and thrust of one period of ``dt`` s for the estimated motion."""
        gains = self.gains()
        velocity_setpoint = _velocity_setpoint(gains, demand, position)
        acceleration = self._acceleration(gains, demand, velocity_setpoint, velocity, dt)
        return _attitude_and_thrust(gains, acceleration, velocity_setpoint, demand.yaw)

    def _acceleration(
        self,
        gains: PositionGains,
        demand: PositionDemand,
        velocity_setpoint: Vector,
        velocity: Vector,
        dt: float,
    ) -> Vector:
        xy = (gains.horizontal_velocity, gains.horizontal_integral)
        z = (gains.vertical_velocity, gains.vertical_integral)
        acceleration = []
        for axis, (proportional, integral) in enumerate((xy, xy, z)):
            feed_forward = demand.acceleration[axis]
            component = 0.0 if isnan(feed_forward) else feed_forward
            velocity_error = velocity_setpoint[axis] - velocity[axis]
            if not isnan(velocity_error):
                new_integral = self._integral[axis] + integral * velocity_error * dt
                self._integral[axis] = max(-GRAVITY / 2, min(GRAVITY / 2, new_integral))
                component += proportional * velocity_error + self._integral[axis]
            acceleration.append(component)
        north, east, down = acceleration
        return (north, east, down)


def _velocity_setpoint(gains: PositionGains, demand: PositionDemand, position: Vector) -> Vector:
    """Return the velocity setpoint, m/s NED; NaN = none."""
    position_gains = (gains.horizontal_position, gains.horizontal_position, gains.vertical_position)
    velocity_setpoint = []
    for axis in range(3):
        position_error = demand.position[axis] - position[axis]
        feed_forward = demand.velocity[axis]
        if isnan(position_error):
            velocity_setpoint.append(feed_forward)
        else:
            velocity_setpoint.append(
                position_gains[axis] * position_error
                + (0.0 if isnan(feed_forward) else feed_forward)
            )
    north, east, down = velocity_setpoint
    speed = hypot(north, east)
    if speed > demand.max_speed:
        north, east = north * demand.max_speed / speed, east * demand.max_speed / speed
    if not isnan(down):
        down = max(-demand.max_up_speed, min(demand.max_down_speed, down))
    return (north, east, down)


def _attitude_and_thrust(
    gains: PositionGains, acceleration: Vector, velocity_setpoint: Vector, yaw: float
) -> PositionOutput:
    """Return attitude and thrust that give an acceleration (NED, m/s^2) at a yaw, within limits."""
    north, east, down = acceleration
    lift = max(GRAVITY - down, 0.1 * GRAVITY)
    horizontal_limit = lift * tan(min(gains.max_tilt, _MAX_TILT))
    horizontal = hypot(north, east)
    if horizontal > horizontal_limit:
        north, east = north * horizontal_limit / horizontal, east * horizontal_limit / horizontal
    specific_thrust = sqrt(north * north + east * east + lift * lift)
    q = _thrust_attitude(
        (-north / specific_thrust, -east / specific_thrust, lift / specific_thrust), yaw
    )
    thrust = gains.hover_thrust * max(GRAVITY - down, 0.0) / GRAVITY
    thrust *= specific_thrust / lift
    thrust = max(gains.min_thrust, min(gains.max_thrust, thrust))
    return PositionOutput(q, thrust, velocity_setpoint, (north, east, down))


def _thrust_attitude(down_axis: Vector, yaw: float) -> Quaternion:
    """Return the attitude with this body down axis (unit, NED) and Euler yaw (rad)."""
    zx, zy, zz = down_axis
    # Tilt about a level axis, then turn about the body's down axis to reach the Euler yaw.
    w = sqrt(max(0.5 * (1.0 + zz), 1e-9))
    tilt = (w, -zy / (2.0 * w), zx / (2.0 * w), 0.0)
    # After both rotations the body x axis must point along the yaw. This gives `yaw_rotation`.
    # `body_x` and `body_y` are the north and east components of the tilted body axes.
    body_x = (1.0 - 2.0 * tilt[2] * tilt[2], 2.0 * tilt[1] * tilt[2])
    body_y = (2.0 * tilt[1] * tilt[2], 1.0 - 2.0 * tilt[1] * tilt[1])
    cos_yaw, sin_yaw = cos(yaw), sin(yaw)
    across_x = body_x[0] * sin_yaw - body_x[1] * cos_yaw
    across_y = body_y[0] * sin_yaw - body_y[1] * cos_yaw
    yaw_rotation = atan2(-across_x, across_y)
    if (body_x[0] * cos(yaw_rotation) + body_y[0] * sin(yaw_rotation)) * cos_yaw + (
        body_x[1] * cos(yaw_rotation) + body_y[1] * sin(yaw_rotation)
    ) * sin_yaw < 0:
        yaw_rotation += copysign(pi, -yaw_rotation)
    cos_half, sin_half = cos(0.5 * yaw_rotation), sin(0.5 * yaw_rotation)
    tw, tx, ty, _ = tilt
    return normalise(
        (tw * cos_half, tx * cos_half + ty * sin_half, ty * cos_half - tx * sin_half, tw * sin_half)
    )
