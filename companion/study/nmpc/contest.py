"""The same flights with every model, in turn, so that what disturbs the machine meets all."""

from math import dist
from typing import NamedTuple

import numpy as np

from companion.attitude import Target
from companion.drag import Drag
from companion.guidance.reference import GRAVITY
from companion.guidance.trajectory.figures import Laps, circle, gerono_eight
from companion.guidance.trajectory.sample import Trajectory
from companion.nmpc import Input, Request, Start, Status, Vehicle
from companion.study.nmpc import vehicle as plant
from companion.study.nmpc.contestants import MODELS, PAPERS, RATE_HZ, SQP_ITERATIONS, Contestant
from companion.study.outcome import Tick
from companion.study.step import Floats

SECONDS = 6
SETTLED = 4.0
"""From when on the error counts, s."""
_INPUTS = 8
"""How many of the latest are remembered: they reach back past dead time and lead."""


class Task(NamedTuple):
    """What is flown, from rest and level at the trajectory's place.

    Attributes:
        name: for tables.
        trajectory: holds its heading.
        begin: where on it the flight begins, s.
    """

    name: str
    trajectory: Trajectory
    begin: float


CIRCLE = Task("circle", circle(5.0, Laps(5.0, laps=4.0)), 5.0)
"""A standing start into the steady part: the vehicle is at rest where it should have 5 m/s."""
EIGHT = Task("eight", gerono_eight(3.0, Laps(5.0, laps=3.0)), 0.0)
"""From rest, at the trajectory's own pace."""


class Flight:
    """One contestant at one task.

    Attributes:
        errors: distance from the trajectory after each period, m.
        path: position after each period, m, NED.
        seconds: of processor time that the solver took each time.
        iterations: of each solve.
        failures: how many solves gave nothing to fly.
    """

    def __init__(self, task: Task, contestant: Contestant) -> None:
        self.errors: list[float] = []
        self.path: list[tuple[float, float, float]] = []
        self.seconds: list[float] = []
        self.iterations: list[float] = []
        self.failures = 0
        self._task = task
        self._solver = contestant.solver(task.trajectory)
        self._solver.warm_up()
        self._vehicle = plant.Vehicle()
        north, east, down = task.trajectory.at(task.begin).position
        self._start = Start((-north, -east, -down))
        self._inputs = [Input(0.0, 0.0, 0.0, 0.0, GRAVITY)]
        self._periods = 0

    def step(self) -> None:
        """One period: ask, and meanwhile fly what was answered before."""
        now, vehicle, flown = self._periods / RATE_HZ, self._vehicle, self._inputs[-1]
        known = Vehicle(
            now,
            vehicle.position,
            vehicle.velocity,
            vehicle.body.q,
            vehicle.body.rates,
            drag=Drag(plant.DRAG),
        )
        at, inputs = self._task.begin + now, tuple(self._inputs[-_INPUTS:])
        answer = self._solver.answer(Request(self._periods, known, at, self._start, inputs))
        self.seconds.append(answer.solving)
        self.iterations.append(answer.iterations)
        if answer.status is Status.SOLVED:
            target = answer.north, answer.east, answer.heading
            self._inputs.append(Input(answer.time, *target, answer.thrust))
        else:
            self.failures += 1
        vehicle.fly(Target(flown.north, flown.east, flown.heading), flown.thrust, 1.0 / RATE_HZ)
        self._periods += 1
        self._note()

    def _note(self) -> None:
        there = self._task.trajectory.at(self._task.begin + self._periods / RATE_HZ).position
        wanted = [a + b for a, b in zip(self._start.position, there, strict=True)]
        self.errors.append(dist(wanted, self._vehicle.position))
        self.path.append(self._vehicle.position)

    @property
    def settled(self) -> Floats:
        """The errors that count, m."""
        return np.array(self.errors[round(SETTLED * RATE_HZ) :])

    @property
    def rms(self) -> float:
        """Of the errors that count, m."""
        return float(np.sqrt(np.mean(self.settled**2)))

    @property
    def worst(self) -> float:
        """Of the errors that count, m."""
        return float(self.settled.max())

    def solve_ms(self, share: float) -> float:
        """The time that this share (in %) of the solves did not exceed, ms."""
        return float(1e3 * np.percentile(self.seconds, share))


Contest = dict[tuple[str, Contestant], Flight]
"""Flights by the name of the task and by who flew it."""


def _enter() -> Contest:
    """Every flight, before its first period."""
    free = [Contestant(model, told=told) for told in (True, False) for model in PAPERS]
    real_time = [*free, Contestant("limited")]
    to_the_end = [Contestant(model, SQP_ITERATIONS) for model in MODELS]
    entries = [(CIRCLE, who) for who in real_time] + [(EIGHT, who) for who in real_time]
    entries += [(EIGHT, who) for who in to_the_end]
    return {(task.name, who): Flight(task, who) for task, who in entries}


def fly_contest(tick: Tick) -> Contest:
    """Fly all, a period of each in turn; who is first changes every time."""
    contest = _enter()
    flights = list(contest.values())
    for second in range(SECONDS):
        tick(f"flights, second {second + 1}")
        for _ in range(round(RATE_HZ)):
            for flight in flights:
                flight.step()
            flights.append(flights.pop(0))
    return contest
