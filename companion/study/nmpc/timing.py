"""Cost of a solve outside flights: iterations of cold starts, and times of the solver process."""

from math import inf
from time import monotonic, sleep
from typing import NamedTuple

import numpy as np

from companion.attitude import BodyRates, Coefficients, attitude
from companion.drag import Drag
from companion.guidance.reference import GRAVITY
from companion.guidance.trajectory.sample import Vector
from companion.nmpc import ControlInput, Request, Solver, Start, Status, Trouble, VehicleSnapshot
from companion.study.nmpc.models import ModelName
from companion.study.nmpc.variants import CIRCLE, DRAG, EIGHT, MODELS, RATE_HZ, Variant
from companion.study.step import Floats

_COLD_ITERATIONS = 60
"""Number of SQP iterations after which a cold start counts as not converged."""
_REQUEST_COUNT = 150
"""Number of requests with which the solver process is timed."""
_START_TIMEOUT_S = 30.0


class State(NamedTuple):
    """A state of the vehicle from which it should fly the circle at 5 m/s."""

    position_error: Vector
    """Position minus the reference position on the circle, m, NED."""
    velocity: Vector
    """Velocity, m/s, NED."""
    coefficients: Coefficients
    """Acceleration coefficients (north, east) of the attitude."""
    body_rates: BodyRates
    """Body rates, rad/s."""


_LEVEL, _NO_ROTATION = Coefficients(0.0, 0.0), BodyRates(0.0, 0.0, 0.0)
_CIRCLE_START = CIRCLE.trajectory.at(CIRCLE.begin)
_V_N, _V_E, _ = _CIRCLE_START.velocity
_ZERO_VELOCITY: Vector = (0.0, 0.0, 0.0)

STATES = {
    "1 m/s too slow": State(_ZERO_VELOCITY, (0.8 * _V_N, 0.8 * _V_E, 0.0), _LEVEL, _NO_ROTATION),
    "at rest": State(_ZERO_VELOCITY, _ZERO_VELOCITY, _LEVEL, _NO_ROTATION),
    "at rest, 3 m away": State((2.0, 2.0, 1.0), _ZERO_VELOCITY, _LEVEL, _NO_ROTATION),
    "the wrong way": State(_ZERO_VELOCITY, (-_V_N, -_V_E, 0.0), _LEVEL, _NO_ROTATION),
    "at rest, 37° of tilt, rolling": State(
        _ZERO_VELOCITY, _ZERO_VELOCITY, Coefficients(-0.36, 0.48), BodyRates(1.5, 0.0, 0.0)
    ),
}

ColdStarts = dict[ModelName, dict[str, float]]
"""Number of SQP iterations to the tolerance, by model and state; inf: not reached."""


def count_iterations() -> ColdStarts:
    """Count the iterations of every model from every state; the initial guess is the reference."""
    counts: ColdStarts = {}
    for model in MODELS:
        solver = Variant(model, _COLD_ITERATIONS).solver(CIRCLE.trajectory)
        counts[model] = {}
        for name, state in STATES.items():
            solver.forget()
            answer = solver.answer(_request_from_state(state))
            reached = answer.status is Status.SOLVED and answer.iterations < _COLD_ITERATIONS
            counts[model][name] = answer.iterations if reached else inf
    return counts


def _request_from_state(state: State) -> Request:
    vehicle = VehicleSnapshot(
        0.0,
        state.position_error,
        state.velocity,
        attitude(state.coefficients, 0.0),
        state.body_rates,
        drag=Drag(DRAG),
    )
    north, east, down = _CIRCLE_START.position
    return Request(0, vehicle, CIRCLE.begin, Start((-north, -east, -down)), ())


class ProcessTimes(NamedTuple):
    """Times of the solver process at 50 Hz, for n answers."""

    answer_ms: Floats
    """(n,), time from before a request is packed until its answer is unpacked, ms."""
    computing_ms: Floats
    """(n,), time in `Worker.answer` (prediction, reference and solve), part of `answer_ms`, ms."""
    bad_answer_count: int
    """Number of answers that were late, failed or implausible."""


def time_process() -> ProcessTimes:
    """Send requests for a vehicle on the figure-eight to the solver process, and time the answers.

    Raises:
        ChildProcessError: the process does not start; the message says why.
    """
    troubles: list[tuple[Trouble, str]] = []
    answer_times, computing_times = [], []
    solver = Solver(
        Variant("limited").settings, EIGHT.trajectory, lambda *trouble: troubles.append(trouble)
    )
    try:
        _await_start(solver, troubles)
        for number in range(_REQUEST_COUNT):
            sent_at = monotonic()
            solver.request(_request_on_the_eight(number))
            answer = solver.take_answer(1.0)
            elapsed = monotonic() - sent_at
            if answer is not None:
                answer_times.append(elapsed)
                computing_times.append(answer.computing_seconds)
            sleep(max(0.0, 1.0 / RATE_HZ - elapsed))
    finally:
        solver.close()
    return ProcessTimes(
        1e3 * np.array(answer_times), 1e3 * np.array(computing_times), len(troubles)
    )


def _await_start(solver: Solver, troubles: list[tuple[Trouble, str]]) -> None:
    deadline = monotonic() + _START_TIMEOUT_S
    while not solver.ready:
        if troubles or monotonic() > deadline:
            raise ChildProcessError(troubles[0][1] if troubles else "the solver does not start")
        sleep(0.01)


def _request_on_the_eight(number: int) -> Request:
    time = number / RATE_HZ
    sample = EIGHT.trajectory.at(time)
    vehicle = VehicleSnapshot(
        time,
        sample.position,
        sample.velocity,
        (1.0, 0.0, 0.0, 0.0),
        BodyRates(0.0, 0.0, 0.0),
        drag=Drag(DRAG),
    )
    inputs = tuple(
        ControlInput(time - k / RATE_HZ, 0.0, 0.0, 0.0, GRAVITY) for k in range(5, 0, -1)
    )
    return Request(number, vehicle, time, Start((0.0, 0.0, 0.0)), inputs)
