"""The flights of the study `nmpc`: all variants fly the tasks with the same simulated vehicle."""

from math import dist

import numpy as np

from companion.attitude import Limits, Quaternion, Target, make_planner
from companion.attitude.kinematics import cos_tilt, half_tilt_products
from companion.drag import Drag
from companion.guidance.reference import GRAVITY
from companion.guidance.trajectory.sample import Vector
from companion.nmpc import ControlInput, Request, Start, Status, VehicleSnapshot
from companion.study.lag_loop import STEP_HZ, LagBody
from companion.study.nmpc.variants import (
    CIRCLE,
    DEAD_TIME_MS,
    DRAG,
    EIGHT,
    GAIN,
    LAG_MS,
    MAX_ITERATIONS,
    MAX_TILT,
    MAX_TILT_RATE,
    MAX_YAW_RATE,
    MODELS,
    RATE_HZ,
    UNLIMITED_MODELS,
    YAW_GAIN,
    Task,
    Variant,
)
from companion.study.outcome import Tick
from companion.study.step import Floats

FLIGHT_S = 6
SETTLED_AFTER_S = 4.0
"""Time after the beginning of a flight from which its errors count, s."""
_INPUT_COUNT = 8
"""Number of past control inputs in a request, enough to predict the motion over the dead time."""
_PLANNER_HZ = 250
_STEPS_PER_SAMPLE = STEP_HZ // _PLANNER_HZ


class Vehicle:
    """A point mass with drag; model-following commands the body rates that its `LagBody` follows.

    The vehicle begins at rest, level, at the origin.

    Attributes:
        position: m, NED.
        velocity: m/s, NED.
        body: attitude and body rates.
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
        """Simulate `seconds` with a constant target and specific thrust (m/s²)."""
        dt = 1.0 / _PLANNER_HZ
        for _ in range(round(seconds * _PLANNER_HZ)):
            acceleration_before = _thrust_and_gravity(self.body.q, thrust)
            rates = self._planner.rates(self.body.q, target, dt, self.body.rates)
            self.body.simulate(rates, _STEPS_PER_SAMPLE)
            acceleration_after = _thrust_and_gravity(self.body.q, thrust)
            self._move(
                tuple(
                    0.5 * (a + b)
                    for a, b in zip(acceleration_before, acceleration_after, strict=True)
                ),
                dt,
            )

    def _move(self, acceleration: tuple[float, ...], dt: float) -> None:
        """Integrate drag and `acceleration` (thrust, gravity; m/s²) over `dt` s, midpoint rule."""
        position, velocity = [], []
        for p, v, a in zip(self.position, self.velocity, acceleration, strict=True):
            midpoint_velocity = v + 0.5 * dt * (a - DRAG * v)
            position.append(p + dt * midpoint_velocity)
            velocity.append(v + dt * (a - DRAG * midpoint_velocity))
        self.position = (position[0], position[1], position[2])
        self.velocity = (velocity[0], velocity[1], velocity[2])


def _thrust_and_gravity(q: Quaternion, thrust: float) -> Vector:
    """Acceleration by thrust and gravity, m/s², NED (equation 10)."""
    _, ax, ay = half_tilt_products(*q)
    return -2.0 * ay * thrust, 2.0 * ax * thrust, GRAVITY - thrust * cos_tilt(q[1], q[2])


class Flight:
    """The flight of one variant on one task.

    Attributes:
        errors: distance from the trajectory after each period, m.
        path: position after each period, m, NED.
        solve_s: processor time of each solve, s.
        iterations: number of iterations of each solve.
    """

    def __init__(self, task: Task, variant: Variant) -> None:
        self.errors: list[float] = []
        self.path: list[tuple[float, float, float]] = []
        self.solve_s: list[float] = []
        self.iterations: list[float] = []
        self._task = task
        self._solver = variant.solver(task.trajectory)
        self._solver.warm_up()
        self._vehicle = Vehicle()
        north, east, down = task.trajectory.at(task.begin).position
        self._start = Start((-north, -east, -down))
        self._inputs = [ControlInput(0.0, 0.0, 0.0, 0.0, GRAVITY)]
        self._period_count = 0

    def step(self) -> None:
        """Simulate one period: solve, and fly with the answer of the previous period."""
        now, vehicle, flown_input = self._period_count / RATE_HZ, self._vehicle, self._inputs[-1]
        known_state = VehicleSnapshot(
            now,
            vehicle.position,
            vehicle.velocity,
            vehicle.body.q,
            vehicle.body.rates,
            drag=Drag(DRAG),
        )
        trajectory_time, inputs = self._task.begin + now, tuple(self._inputs[-_INPUT_COUNT:])
        answer = self._solver.answer(
            Request(self._period_count, known_state, trajectory_time, self._start, inputs)
        )
        self.solve_s.append(answer.solver_seconds)
        self.iterations.append(answer.iterations)
        if answer.status is Status.SOLVED:
            target = answer.north, answer.east, answer.heading
            self._inputs.append(ControlInput(answer.time, *target, answer.thrust))
        vehicle.fly(
            Target(flown_input.north, flown_input.east, flown_input.heading),
            flown_input.thrust,
            1.0 / RATE_HZ,
        )
        self._period_count += 1
        self._record()

    def _record(self) -> None:
        reference = self._task.trajectory.at(
            self._task.begin + self._period_count / RATE_HZ
        ).position
        shifted_reference = [a + b for a, b in zip(self._start.position, reference, strict=True)]
        self.errors.append(dist(shifted_reference, self._vehicle.position))
        self.path.append(self._vehicle.position)

    @property
    def settled_errors(self) -> Floats:
        """The errors from `SETTLED_AFTER_S` on, m."""
        return np.array(self.errors[round(SETTLED_AFTER_S * RATE_HZ) :])

    @property
    def rms(self) -> float:
        """Root mean square of the settled errors, m."""
        return float(np.sqrt(np.mean(self.settled_errors**2)))

    @property
    def largest_error(self) -> float:
        """Largest settled error, m."""
        return float(self.settled_errors.max())

    def solve_ms(self, percentile: float) -> float:
        """Percentile of the solve times, ms."""
        return float(1e3 * np.percentile(self.solve_s, percentile))


Flights = dict[tuple[str, Variant], Flight]
"""The flights, by name of the task and by variant."""


def fly_all(tick: Tick) -> Flights:
    """Fly all variants side by side, one period of each in turn.

    Other load on the computer therefore slows all equally. The order rotates with every period.
    """
    flights = _new_flights()
    flight_order = list(flights.values())
    for second in range(FLIGHT_S):
        tick(f"flights, second {second + 1}")
        for _ in range(round(RATE_HZ)):
            for flight in flight_order:
                flight.step()
            flight_order.append(flight_order.pop(0))
    return flights


def _new_flights() -> Flights:
    """All flights of the study, before their first period."""
    unlimited_variants = [
        Variant(model, knows_dead_time=knows_dead_time)
        for knows_dead_time in (True, False)
        for model in UNLIMITED_MODELS
    ]
    real_time_variants = [*unlimited_variants, Variant("limited")]
    converging_variants = [Variant(model, MAX_ITERATIONS) for model in MODELS]
    entries = [(CIRCLE, variant) for variant in real_time_variants]
    entries += [(EIGHT, variant) for variant in (*real_time_variants, *converging_variants)]
    return {(task.name, variant): Flight(task, variant) for task, variant in entries}
