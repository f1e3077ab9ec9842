"""The vehicle of the study: model-following behind a rate loop, and a point mass with drag."""

from math import radians

from companion.attitude import Limits, Quaternion, Target, make_planner
from companion.attitude.kinematics import cos_tilt, tilt_products
from companion.guidance.reference import GRAVITY
from companion.guidance.trajectory.sample import Vector
from companion.study.lag_loop import STEP_HZ, LagBody

GAIN, YAW_GAIN = 5.0, 2.0
"""Of the planner, 1/s."""
LAG_MS, DEAD_TIME_MS = 25, 45
DRAG = 1.0
"""1/s, as PX4's simulated airframe has it."""
MAX_TILT, MAX_TILT_RATE, MAX_YAW_RATE = radians(50.0), radians(120.0), radians(60.0)
THRUSTS = (3.0, 18.0)
"""Least and largest specific thrust, m/s²."""

_PLANNER_HZ = 250
_STEPS = STEP_HZ // _PLANNER_HZ


class Vehicle:
    """Flies targets and thrusts.

    It begins at rest, level, at the origin.

    Attributes:
        position: m, NED.
        velocity: m/s, NED.
        body: its attitude and body rates.
    """

    def __init__(self) -> None:
        self.position: Vector = (0.0, 0.0, 0.0)
        self.velocity: Vector = (0.0, 0.0, 0.0)
        self.body = LagBody((1.0, 0.0, 0.0, 0.0), LAG_MS, DEAD_TIME_MS)
        self._planner = make_planner(
            "model-following",
            GAIN,
            YAW_GAIN,
            Limits(MAX_TILT, MAX_TILT_RATE, MAX_YAW_RATE),
            lag=1e-3 * LAG_MS,
            dead_time=1e-3 * DEAD_TIME_MS,
        )

    def fly(self, target: Target, thrust: float, seconds: float) -> None:
        """Hold a target and a specific thrust (m/s²) for a while."""
        dt = 1.0 / _PLANNER_HZ
        for _ in range(round(seconds * _PLANNER_HZ)):
            before = _lift(self.body.q, thrust)
            rates = self._planner.rates(self.body.q, target, dt, self.body.rates)
            self.body.turn(rates, _STEPS)
            after = _lift(self.body.q, thrust)
            self._move(tuple(0.5 * (a + b) for a, b in zip(before, after, strict=True)), dt)

    def _move(self, lift: tuple[float, ...], dt: float) -> None:
        """Thrust, gravity and drag over a short time; the drag at the middle of it."""
        position, velocity = [], []
        for p, v, push in zip(self.position, self.velocity, lift, strict=True):
            middle = v + 0.5 * dt * (push - DRAG * v)
            position.append(p + dt * middle)
            velocity.append(v + dt * (push - DRAG * middle))
        self.position = (position[0], position[1], position[2])
        self.velocity = (velocity[0], velocity[1], velocity[2])


def _lift(q: Quaternion, thrust: float) -> Vector:
    """Acceleration by thrust and gravity, m/s², NED (equation 10)."""
    _, ax, ay = tilt_products(*q)
    return -2.0 * ay * thrust, 2.0 * ax * thrust, GRAVITY - thrust * cos_tilt(q[1], q[2])
