"""How far the last body rates carry a vehicle whose setpoints have ended: a simple worst case.

The autopilot holds the last rates and the last thrust. So the thrust axis goes on turning along a
great circle, while drag slows the vehicle. What feedback had added to the rates may have any
direction: it widens the result by a spread. Then the autopilot's failsafe levels the vehicle, and
brakes or lets it drift. Compared with the bundled vehicles by `tests/flight/test_killed.py`.
"""

from math import acos, cos, hypot, pi, sin, sqrt
from typing import NamedTuple

from companion.drag import Drag
from companion.guidance.fence import Fence
from companion.guidance.reference import GRAVITY, Vector

_STEPS = 20
_FEEDBACK = 0.15
"""Feedback adds at most this to the rates of a smooth path, rad/s (on the bundled vehicles 0.1)."""
_NOTICED = 0.1
"""The failsafe begins this much later than its parameter says, s (PX4: 0.06 to 0.11)."""
_LEVELLING = 3.0
"""The autopilot levels the vehicle this fast, rad/s (PX4's limit: 3.8)."""
_CLIMB_BRAKING = 4.0
"""The autopilot ends a climb or a fall with this, m/s² (PX4: MPC_ACC_UP_MAX)."""
_LEAST_DRAG = 0.2
"""Least drag of any multirotor, 1/s (measured: 0.25 and more). Only drag stops a level drift."""


class Flown(NamedTuple):
    """What is flown at the moment when the setpoints end.

    Attributes:
        offset: Place, from where control began, m NED.
        velocity: m/s NED.
        thrust: Specific thrust, m/s² NED; level at hover it is (0, 0, −g).
        turn: Its rate of change, m/s³ NED.
    """

    offset: Vector
    velocity: Vector
    thrust: Vector
    turn: Vector


class Loss(NamedTuple):
    """The vehicle and its offboard-loss failsafe.

    Attributes:
        held: For how long the autopilot holds the last rates, s.
        brakes: Whether it stops the vehicle then; else the vehicle drifts on until drag ends it.
        drag: No drag where it is not known.
        max_tilt_rate: Of the rates that are sent, rad/s.
        fence: Its braking formula.
    """

    held: float
    brakes: bool
    drag: Drag
    max_tilt_rate: float
    fence: Fence


class Reach(NamedTuple):
    """Where the vehicle can be carried, from where the setpoints ended; m.

    Attributes:
        place: Where it stops by the rates of the path itself, (north, east).
        spread: How far from there it can stop, in any direction.
        up: How far above.
        down: How far below.
    """

    place: tuple[float, float]
    spread: float
    up: float
    down: float

    @property
    def away(self) -> float:
        """The largest horizontal distance."""
        return hypot(*self.place) + self.spread


class _Held(NamedTuple):
    """After the held rates: way and velocity by the path's rates, what feedback adds, the tilt."""

    way: Vector
    velocity: Vector
    extra_way: float
    extra_speed: float
    highest: float
    tilt: float


def reach(flown: Flown, loss: Loss) -> Reach:
    """How far the vehicle can be carried if the setpoints end now."""
    held = _hold(flown, loss)
    size = hypot(*flown.thrust)
    speed = hypot(*held.velocity[:2])
    widest = speed + held.extra_speed
    stop, farthest = (_stop(value, held.tilt, size, loss) for value in (speed, widest))
    north, east = (
        way + (stop * component / speed if speed > 0.0 else 0.0)
        for way, component in zip(held.way[:2], held.velocity[:2], strict=True)
    )
    up_speed = max(0.0, held.extra_speed - held.velocity[2])
    up = held.highest + held.extra_way + up_speed * _NOTICED + _brake(up_speed)
    return Reach((north, east), held.extra_way + farthest - stop, up, _fall(held, size))


def _hold(flown: Flown, loss: Loss) -> _Held:
    """Rates and thrust held: the thrust axis runs along a great circle."""
    duration = loss.held + _NOTICED
    step = duration / _STEPS
    size = hypot(*flown.thrust)
    axis: Vector = _scaled(flown.thrust, 1.0 / size)
    along = sum(a * b for a, b in zip(axis, flown.turn, strict=True))
    across: Vector = _plus(flown.turn, axis, -along)
    rate = hypot(*across) / size
    ahead = _scaled(across, 1.0 / (rate * size)) if rate > 0.0 else (0.0, 0.0, 0.0)
    rate = min(rate, loss.max_tilt_rate)
    feedback = min(_FEEDBACK, loss.max_tilt_rate)
    way, velocity, thrust = (0.0, 0.0, 0.0), flown.velocity, axis
    extra_way = extra_speed = highest = 0.0
    for index in range(_STEPS):
        angle = rate * (index + 0.5) * step
        thrust = _plus(_scaled(axis, cos(angle)), ahead, sin(angle))
        velocity = _plus(_slowed(velocity, loss.drag, step), thrust, size * step)
        velocity = (velocity[0], velocity[1], velocity[2] + GRAVITY * step)
        way = _plus(way, velocity, step)
        stray = 2.0 * size * sin(0.5 * min(pi, feedback * (index + 0.5) * step))
        extra_speed += (stray - loss.drag.linear * extra_speed) * step
        extra_way += extra_speed * step
        highest = max(highest, -way[2])
    tilt = acos(max(-1.0, min(1.0, -thrust[2]))) + feedback * duration
    return _Held(way, velocity, extra_way, extra_speed, highest, min(pi, tilt))


def _stop(speed: float, tilt: float, size: float, loss: Loss) -> float:
    """How far it goes on horizontally after the rates were held, m."""
    if loss.brakes:
        return float(loss.fence.stop((0.0, 0.0, 0.0), (speed, 0.0, 0.0))[0])
    levelled = _level_time(tilt)
    speed += size * sin(min(tilt, 0.5 * pi)) * levelled
    return speed * levelled + speed / max(loss.drag.linear, _LEAST_DRAG)


def _fall(held: _Held, size: float) -> float:
    """How far it can fall while the rates are held, while it levels and until it stops, m."""
    duration = _level_time(held.tilt)
    mean = sin(held.tilt) / held.tilt if held.tilt > 0.0 else 1.0  # of the cosine, while it levels
    speed = held.velocity[2] + held.extra_speed
    fall = held.way[2] + held.extra_way
    gain = max(0.0, GRAVITY - size * mean)
    fall += max(0.0, speed) * duration + 0.5 * gain * duration * duration
    return max(0.0, fall + _brake(max(0.0, speed) + gain * duration))


def _level_time(tilt: float) -> float:
    """How long the autopilot takes to level the vehicle, s."""
    return _NOTICED + tilt / _LEVELLING


def _brake(speed: float) -> float:
    return speed * speed / (2.0 * _CLIMB_BRAKING)


def _scaled(a: Vector, factor: float) -> Vector:
    return a[0] * factor, a[1] * factor, a[2] * factor


def _plus(a: Vector, b: Vector, factor: float) -> Vector:
    return a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]


def _slowed(velocity: Vector, drag: Drag, span: float) -> Vector:
    """Apply drag to the horizontal velocity only: a fall is assumed undamped, to be safe."""
    north, east, _ = drag.deceleration((velocity[0], velocity[1], 0.0))
    return velocity[0] - north * span, velocity[1] - east * span, velocity[2]


def path_thrust(acceleration: Vector, velocity: Vector, drag: Drag) -> Vector:
    """Specific thrust that a path takes, m/s² NED: its acceleration, against drag and gravity."""
    north, east, down = acceleration
    slowed = drag.deceleration(velocity)
    return north + slowed[0], east + slowed[1], down - GRAVITY


def tilted_thrust(north: float, east: float) -> Vector:
    """Specific thrust at coefficients (the sine of the tilt) that holds the height, m/s² NED."""
    up = sqrt(max(0.01, 1.0 - north * north - east * east))
    return GRAVITY * north / up, GRAVITY * east / up, -GRAVITY
