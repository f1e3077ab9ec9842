"""The solver in its own process: how long an answer takes, all that goes to and fro included."""

from time import monotonic, sleep
from typing import NamedTuple

import numpy as np

from companion.attitude import BodyRates
from companion.drag import Drag
from companion.guidance.reference import GRAVITY
from companion.nmpc import Input, Request, Solver, Start, Trouble, Vehicle
from companion.study.nmpc import vehicle as plant
from companion.study.nmpc.contest import EIGHT
from companion.study.nmpc.contestants import RATE_HZ, Contestant
from companion.study.step import Floats

_REQUESTS = 150
_LONGEST_START = 30.0  # s


class Exchange(NamedTuple):
    """What was measured at 50 Hz, n answers.

    Attributes:
        whole_ms: (n,), from before a request is packed until its answer is unpacked.
        solve_ms: (n,), of that in `Worker.answer`.
        troubles: how many requests came to nothing.
    """

    whole_ms: Floats
    solve_ms: Floats
    troubles: int


def time_exchange() -> Exchange:
    """Ask our model's solver for a vehicle that is on the eight, waiting for each answer.

    Raises:
        ChildProcessError: the process does not come up; the message says why.
    """
    troubles: list[tuple[Trouble, str]] = []
    whole, solve = [], []
    solver = Solver(
        Contestant("limited").settings, EIGHT.trajectory, lambda *trouble: troubles.append(trouble)
    )
    try:
        _wait(solver, troubles)
        for number in range(_REQUESTS):
            began = monotonic()
            solver.request(_request(number))
            answer = solver.take(1.0)
            took = monotonic() - began
            if answer is not None:
                whole.append(took)
                solve.append(answer.seconds)
            sleep(max(0.0, 1.0 / RATE_HZ - took))
    finally:
        solver.close()
    return Exchange(1e3 * np.array(whole), 1e3 * np.array(solve), len(troubles))


def _wait(solver: Solver, troubles: list[tuple[Trouble, str]]) -> None:
    until = monotonic() + _LONGEST_START
    while not solver.ready:
        if troubles or monotonic() > until:
            raise ChildProcessError(troubles[0][1] if troubles else "the solver does not come up")
        sleep(0.01)


def _request(number: int) -> Request:
    time = number / RATE_HZ
    sample = EIGHT.trajectory.at(time)
    vehicle = Vehicle(
        time,
        sample.position,
        sample.velocity,
        (1.0, 0.0, 0.0, 0.0),
        BodyRates(0.0, 0.0, 0.0),
        drag=Drag(plant.DRAG),
    )
    inputs = tuple(Input(time - k / RATE_HZ, 0.0, 0.0, 0.0, GRAVITY) for k in range(5, 0, -1))
    return Request(number, vehicle, time, Start((0.0, 0.0, 0.0)), inputs)
