"""How many iterations a model needs from where it has not planned before, if it gets there."""

from math import inf
from typing import NamedTuple

from companion.attitude import BodyRates, Coefficients, attitude
from companion.drag import Drag
from companion.guidance.trajectory.sample import Vector
from companion.nmpc import Request, Start, Status, Vehicle
from companion.study.nmpc import vehicle as plant
from companion.study.nmpc.contest import CIRCLE
from companion.study.nmpc.contestants import MODELS, Contestant
from companion.study.nmpc.models import ModelName

MOST_ITERATIONS = 60


class State(NamedTuple):
    """How the vehicle is found, while it should be on the circle at 5 m/s.

    Attributes:
        away: from its place on the circle, m, NED.
        velocity: m/s, NED.
        coefficients: of its attitude.
        body_rates: rad/s.
    """

    away: Vector
    velocity: Vector
    coefficients: Coefficients
    body_rates: BodyRates


_LEVEL, _STILL = Coefficients(0.0, 0.0), BodyRates(0.0, 0.0, 0.0)
_ON_THE_CIRCLE = CIRCLE.trajectory.at(CIRCLE.begin)
_V_N, _V_E, _ = _ON_THE_CIRCLE.velocity
_REST: Vector = (0.0, 0.0, 0.0)


STATES = {
    "1 m/s too slow": State(_REST, (0.8 * _V_N, 0.8 * _V_E, 0.0), _LEVEL, _STILL),
    "at rest": State(_REST, _REST, _LEVEL, _STILL),
    "at rest, 3 m away": State((2.0, 2.0, 1.0), _REST, _LEVEL, _STILL),
    "the wrong way": State(_REST, (-_V_N, -_V_E, 0.0), _LEVEL, _STILL),
    "at rest, 37° of tilt, rolling": State(
        _REST, _REST, Coefficients(-0.36, 0.48), BodyRates(1.5, 0.0, 0.0)
    ),
}

Counts = dict[ModelName, dict[str, float]]
"""SQP iterations by model and state; inf where the tolerance was not reached."""


def count_iterations() -> Counts:
    """Solve every state with every model, each from its reference, to the end."""
    counts: Counts = {}
    for model in MODELS:
        solver = Contestant(model, MOST_ITERATIONS).solver(CIRCLE.trajectory)
        counts[model] = {}
        for name, state in STATES.items():
            solver.forget()
            answer = solver.answer(_request(state))
            reached = answer.status is Status.SOLVED and answer.iterations < MOST_ITERATIONS
            counts[model][name] = answer.iterations if reached else inf
    return counts


def _request(state: State) -> Request:
    vehicle = Vehicle(
        0.0,
        state.away,
        state.velocity,
        attitude(state.coefficients, 0.0),
        state.body_rates,
        drag=Drag(plant.DRAG),
    )
    north, east, down = _ON_THE_CIRCLE.position
    return Request(0, vehicle, CIRCLE.begin, Start((-north, -east, -down)), ())
