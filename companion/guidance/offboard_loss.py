"""How far a vehicle can move after its setpoints have ended: a simple worst case.

First the autopilot holds the last rates and the last thrust: the thrust axis keeps turning along a
great circle, while drag slows the vehicle. The part of the rates that is feedback may have any
direction, so it adds a radius to the result. Then the autopilot's failsafe levels the vehicle, and
brakes it or lets it drift. `tests/flight/test_killed.py` compares this worst case with
the mock vehicles.
"""

from math import acos, cos, hypot, pi, sin, sqrt
from typing import NamedTuple

from companion.drag import Drag
from companion.guidance.fence import Fence
from companion.guidance.reference import GRAVITY, Vector

_INTEGRATION_STEPS = 20
"""Number of integration steps while the rates are held."""
_FEEDBACK_RATE = 0.15
"""Largest body rate that feedback may command on a smooth path, rad/s (measured on mock vehicles:
0.1)."""
_FAILSAFE_DELAY = 0.1
"""Delay of the failsafe beyond the time in its parameter, s (PX4: 0.06 to 0.11)."""
_LEVELLING_RATE = 3.0
"""Rate at which the autopilot levels the vehicle, rad/s (PX4's limit: 3.8)."""
_VERTICAL_BRAKING = 4.0
"""Deceleration with which the autopilot ends a climb or a fall, m/s² (PX4: MPC_ACC_UP_MAX)."""
_SMALLEST_THRUST = 1e-6
"""Lower bound of the specific thrust whose axis turns, m/s²."""
_SMALLEST_DRAG = 0.2
"""Linear drag that any multirotor is assumed to have at least, 1/s; the smallest measured one is
0.25. Drag alone stops the drift of a level vehicle."""


class MotionAtLoss(NamedTuple):
    """Motion and thrust at the moment when the setpoints end.

    Attributes:
        offset: position from where control began, m NED.
        velocity: velocity, m/s NED.
        thrust: specific thrust, m/s² NED; at hover it is (0, 0, −g).
        thrust_rate: derivative of `thrust`, m/s³ NED.
    """

    offset: Vector
    velocity: Vector
    thrust: Vector
    thrust_rate: Vector


class LossFailsafe(NamedTuple):
    """The vehicle and its offboard-loss failsafe.

    Attributes:
        hold_time: time for which the autopilot holds the last rates, s.
        brakes: whether the failsafe brakes the vehicle; False: it drifts until drag stops it.
        drag: drag of the vehicle; no drag if it is unknown.
        max_tilt_rate: largest tilt rate that is sent, rad/s.
        fence: the fence, whose braking formula is used.
    """

    hold_time: float
    brakes: bool
    drag: Drag
    max_tilt_rate: float
    fence: Fence


class Reach(NamedTuple):
    """Where the vehicle can stop and climb to, relative to where the setpoints ended.

    Attributes:
        stop_position: point (north, east) of the stop if the last rates contain no feedback, m.
        stop_radius: radius around `stop_position` in which the stop lies if the last rates contain
            feedback, m.
        max_climb: largest climb, m.
        max_fall: largest fall, m.
    """

    stop_position: tuple[float, float]
    stop_radius: float
    max_climb: float
    max_fall: float

    @property
    def largest_distance(self) -> float:
        """Largest horizontal distance from where the setpoints ended to the stop, m."""
        return hypot(*self.stop_position) + self.stop_radius


class _HeldMotion(NamedTuple):
    """Motion of the vehicle from the loss of setpoints until the autopilot stops holding the rates.

    The held rates are planned rates plus unknown rates that feedback has commanded.

    Attributes:
        displacement: displacement by the planned rates alone, m NED.
        velocity: final velocity by the planned rates alone, m/s NED.
        feedback_displacement: displacement that the feedback rates add in the worst direction, m.
        feedback_speed: speed that the feedback rates add in the worst direction, m/s.
        greatest_height: greatest height above the point of the loss, by the planned rates alone, m.
        tilt: largest possible final tilt, rad.
    """

    displacement: Vector
    velocity: Vector
    feedback_displacement: float
    feedback_speed: float
    greatest_height: float
    tilt: float


def reach(at_loss: MotionAtLoss, failsafe: LossFailsafe) -> Reach:
    """How far the vehicle can move if the setpoints end at this motion."""
    held = _held_motion(at_loss, failsafe)
    specific_thrust = hypot(*at_loss.thrust)
    speed = hypot(*held.velocity[:2])
    largest_speed = speed + held.feedback_speed
    stop = _stopping_distance(speed, held.tilt, specific_thrust, failsafe)
    farthest_stop = _stopping_distance(largest_speed, held.tilt, specific_thrust, failsafe)
    north, east = (
        displacement + (stop * component / speed if speed > 0.0 else 0.0)
        for displacement, component in zip(held.displacement[:2], held.velocity[:2], strict=True)
    )
    up_speed = max(0.0, held.feedback_speed - held.velocity[2])
    max_climb = (
        held.greatest_height
        + held.feedback_displacement
        + up_speed * _FAILSAFE_DELAY
        + _braking_distance(up_speed)
    )
    return Reach(
        (north, east),
        held.feedback_displacement + farthest_stop - stop,
        max_climb,
        _fall_distance(held, specific_thrust),
    )


def _held_motion(at_loss: MotionAtLoss, failsafe: LossFailsafe) -> _HeldMotion:
    """Integrate the motion while the autopilot holds rates and thrust."""
    duration = failsafe.hold_time + _FAILSAFE_DELAY
    step = duration / _INTEGRATION_STEPS
    # Without thrust there is no axis that could turn, and a turn has no effect.
    specific_thrust = max(hypot(*at_loss.thrust), _SMALLEST_THRUST)
    axis = _scaled(at_loss.thrust, 1.0 / specific_thrust)
    axial = sum(a * b for a, b in zip(axis, at_loss.thrust_rate, strict=True))
    lateral = _plus_scaled(at_loss.thrust_rate, axis, -axial)
    rotation_rate = hypot(*lateral) / specific_thrust
    direction = (
        _scaled(lateral, 1.0 / (rotation_rate * specific_thrust))
        if rotation_rate > 0.0
        else (0.0, 0.0, 0.0)
    )
    rotation_rate = min(rotation_rate, failsafe.max_tilt_rate)
    feedback_rate = min(_FEEDBACK_RATE, failsafe.max_tilt_rate)
    displacement, velocity, thrust = (0.0, 0.0, 0.0), at_loss.velocity, axis
    feedback_displacement = feedback_speed = greatest_height = 0.0
    slowing = 1.0 + failsafe.drag.linear * step  # backward Euler, as in `_after_drag`
    for index in range(_INTEGRATION_STEPS):
        angle = rotation_rate * (index + 0.5) * step
        thrust = _plus_scaled(_scaled(axis, cos(angle)), direction, sin(angle))
        velocity = _plus_scaled(
            _after_drag(velocity, failsafe.drag, step), thrust, specific_thrust * step
        )
        velocity = (velocity[0], velocity[1], velocity[2] + GRAVITY * step)
        displacement = _plus_scaled(displacement, velocity, step)
        # The acceleration by a thrust axis that feedback has turned by this angle.
        feedback_angle = min(pi, feedback_rate * (index + 0.5) * step)
        acceleration = 2.0 * specific_thrust * sin(0.5 * feedback_angle)
        feedback_speed = (feedback_speed + acceleration * step) / slowing
        feedback_displacement += feedback_speed * step
        greatest_height = max(greatest_height, -displacement[2])
    tilt = acos(max(-1.0, min(1.0, -thrust[2]))) + feedback_rate * duration
    return _HeldMotion(
        displacement,
        velocity,
        feedback_displacement,
        feedback_speed,
        greatest_height,
        min(pi, tilt),
    )


def _stopping_distance(
    speed: float, tilt: float, specific_thrust: float, failsafe: LossFailsafe
) -> float:
    """Horizontal distance from the end of the held rates to the stop, m."""
    if failsafe.brakes:
        return float(failsafe.fence.stopping_point((0.0, 0.0, 0.0), (speed, 0.0, 0.0))[0])
    level_time = _level_time(tilt)
    speed += specific_thrust * sin(min(tilt, 0.5 * pi)) * level_time
    return speed * level_time + speed / max(failsafe.drag.linear, _SMALLEST_DRAG)


def _fall_distance(held: _HeldMotion, specific_thrust: float) -> float:
    """Largest fall while the rates are held, while the vehicle levels and until it stops, m."""
    duration = _level_time(held.tilt)
    mean_cosine = sin(held.tilt) / held.tilt if held.tilt > 0.0 else 1.0  # while it levels
    speed = held.velocity[2] + held.feedback_speed
    fall = held.displacement[2] + held.feedback_displacement
    acceleration = max(0.0, GRAVITY - specific_thrust * mean_cosine)
    fall += max(0.0, speed) * duration + 0.5 * acceleration * duration * duration
    return max(0.0, fall + _braking_distance(max(0.0, speed) + acceleration * duration))


def _level_time(tilt: float) -> float:
    """Time until the autopilot has levelled the vehicle, s, including the failsafe's delay."""
    return _FAILSAFE_DELAY + tilt / _LEVELLING_RATE


def _braking_distance(speed: float) -> float:
    return speed * speed / (2.0 * _VERTICAL_BRAKING)


def _scaled(a: Vector, factor: float) -> Vector:
    return a[0] * factor, a[1] * factor, a[2] * factor


def _plus_scaled(a: Vector, b: Vector, factor: float) -> Vector:
    return a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]


def _after_drag(velocity: Vector, drag: Drag, duration: float) -> Vector:
    """Velocity after `duration` s of horizontal drag, m/s NED.

    Backward Euler, so that drag never reverses the motion, however long `duration` is. Vertical
    drag is left out: without it a fall is longest, which is the worst case.
    """
    north, east, down = velocity
    share = 1.0 / (1.0 + drag.per_velocity(hypot(north, east)) * duration)
    return share * north, share * east, down


def path_thrust(acceleration: Vector, velocity: Vector, drag: Drag) -> Vector:
    """Specific thrust that a path with this acceleration and velocity needs, m/s² NED."""
    north, east, down = acceleration
    deceleration = drag.deceleration(velocity)
    return north + deceleration[0], east + deceleration[1], down - GRAVITY


def tilted_thrust(north: float, east: float) -> Vector:
    """Specific thrust that holds the height at the coefficients (north, east), m/s² NED."""
    up = sqrt(max(0.01, 1.0 - north * north - east * east))
    return GRAVITY * north / up, GRAVITY * east / up, -GRAVITY
