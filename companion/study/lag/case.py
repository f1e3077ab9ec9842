"""One case in full: between what PX4 and ArduPilot were measured to have."""

from math import pi
from typing import NamedTuple

from companion.attitude import Limits
from companion.study.lag.belief import FINER, Belief, belief_table, beliefs, planner_told
from companion.study.lag.flown import METHODS, SCORE_COLUMNS, score, score_of, step_at
from companion.study.lag.grid import times_of
from companion.study.lag.loop import LagLoop
from companion.study.measures import largest_tilt_rate
from companion.study.methods import FOLLOWING, Method
from companion.study.step import Response, fly_loop
from companion.study.table import Cell, Table

LOOP = LagLoop(lag_ms=25, dead_time_ms=45)
MAX_TILT_RATE = pi / 2.0
"""W_M of the flights with a rate limit, rad/s."""
TOLD_AT_HZ = (100.0, 250.0)
WRONG_AT_HZ = 100.0

_TIMES = times_of(LOOP)


class Case(NamedTuple):
    """What was flown of the case.

    Attributes:
        free: every method by rate (Hz), without limits.
        limited: model-following with W_M, by rate.
        wrong: cross-track of model-following at 100 Hz by what it believes, the truth included.
    """

    free: dict[float, dict[Method, Response]]
    limited: dict[float, Response]
    wrong: dict[Belief, float]


def fly_case() -> Case:
    """Fly it with every method, with the rate limit, and with wrong times."""
    limits = Limits(max_tilt_rate=MAX_TILT_RATE)
    return Case(
        {hz: {m: _fly(m, hz, Limits()) for m in METHODS} for hz in TOLD_AT_HZ},
        {hz: _fly(FOLLOWING, hz, limits) for hz in TOLD_AT_HZ},
        {
            belief: score_of(
                planner_told(FOLLOWING, _TIMES.believed(belief)), LOOP, WRONG_AT_HZ
            ).cross_track
            for belief in beliefs(FINER)
        },
    )


def _fly(method: Method, rate_hz: float, limits: Limits) -> Response:
    return fly_loop(planner_told(method, _TIMES, limits), step_at(rate_hz), LOOP)


def case_table(case: Case) -> Table:
    """Every method by rate, and model-following with the rate limit."""
    rows: list[tuple[Cell, ...]] = []
    for rate, responses in case.free.items():
        flown = [(method.label, response) for method, response in responses.items()]
        flown.append(("model-following, W_M = π/2", case.limited[rate]))
        rows += [
            (label, round(rate), *score(response), largest_tilt_rate(response))
            for label, response in flown
        ]
    return Table(
        "lag",
        f"The case in full: dead time {LOOP.dead_time_ms} ms, lag {LOOP.lag_ms} ms.",
        ("method", "rate, Hz", *SCORE_COLUMNS, "largest √(ω_x²+ω_y²), rad/s"),
        tuple(rows),
    )


def wrong_table(case: Case) -> Table:
    """model-following with wrong times, at 100 Hz."""
    return belief_table(
        "lag-wrong-knowledge",
        f"Cross-track of model-following at {WRONG_AT_HZ:.0f} Hz in the same case, by what it"
        " believes of the lag (rows) and of the dead time (columns), against the truth.",
        case.wrong,
    )
