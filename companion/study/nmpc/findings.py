"""What the study says of the paper's claims, and of ours; each made from its numbers."""

from collections.abc import Sequence
from math import isinf
from typing import Literal

import numpy as np

from companion.study.nmpc.cold_start import STATES, Counts
from companion.study.nmpc.contest import CIRCLE, EIGHT, Contest
from companion.study.nmpc.contestants import (
    LOOKS,
    MODELS,
    PAPERS,
    RATE_HZ,
    SQP_ITERATIONS,
    Contestant,
)
from companion.study.nmpc.exchange import Exchange
from companion.study.nmpc.models import ModelName
from companion.study.outcome import Finding

_SETTLED_M = 0.1
"""A flight whose error stays below this over its last seconds has settled."""
_LAST = round(2.0 * RATE_HZ)
_WHOLE_MS = 10.0


def find(contest: Contest, counts: Counts, exchange: Exchange) -> tuple[Finding, ...]:
    """All findings."""
    return (
        _solved_faster("paper", ("euler", "quaternion"), contest),
        _solved_faster("asked", ("euler-reduced",), contest),
        _from_cold(counts),
        _settles("limited", contest),
        _settles("proposed", contest),
        _dead_time(contest),
        _nearest(contest),
        _in_time(exchange),
    )


def _solved_faster(
    source: Literal["paper", "asked"], others: Sequence[ModelName], contest: Contest
) -> Finding:
    """Whether the proposed model is, by one iteration and to the end."""
    shares = {
        (model, most): _typical(model, most, contest) / _typical("proposed", most, contest)
        for model in others
        for most in (1, SQP_ITERATIONS)
    }
    told = "; ".join(
        f"{LOOKS[model].label} takes {shares[model, 1]:.2f} × its time by one iteration,"
        f" {shares[model, SQP_ITERATIONS]:.2f} × to the end"
        for model in others
    )
    names = " and ".join(LOOKS[model].label for model in others)
    return Finding(
        source,
        f"The proposed model is solved faster than {names}.",
        min(shares.values()) > 1.0,
        f"Medians: {told}.",
    )


def _typical(model: ModelName, iterations: int, contest: Contest) -> float:
    return contest[EIGHT.name, Contestant(model, iterations)].solve_ms(50)


def _from_cold(counts: Counts) -> Finding:
    reached = {m: sum(not isinf(count) for count in counts[m].values()) for m in MODELS}
    others = max(reached[model] for model in PAPERS)
    told = ", ".join(f"{LOOKS[model].label} {reached[model]}" for model in MODELS)
    return Finding(
        "asked",
        "With its limits as constraints the problem converges from further off.",
        reached["limited"] > others,
        f"States out of {len(STATES)} from which the tolerance is reached: {told}.",
    )


def _settles(model: ModelName, contest: Contest) -> Finding:
    flight = contest[CIRCLE.name, Contestant(model)]
    last = max(flight.errors[-_LAST:])
    return Finding(
        "asked",
        f"From a standing start, {LOOKS[model].label} settles on the circle within 4 s.",
        last < _SETTLED_M,
        f"The error is {max(flight.errors):.2g} m at most, and {last:.2g} m in the last 2 s of 6 s"
        f" (bound {_SETTLED_M:g} m).",
    )


def _nearest(contest: Contest) -> Finding:
    told = []
    for task in (CIRCLE, EIGHT):
        errors = {model: contest[task.name, Contestant(model)].rms for model in MODELS}
        other = min((errors[model], LOOKS[model].label) for model in PAPERS)
        told.append((task.name, errors["limited"], *other))
    return Finding(
        "asked",
        "Told the dead time alike, our model flies nearest to both trajectories.",
        all(ours < theirs for _, ours, theirs, _ in told),
        "; ".join(
            f"{name}: {ours:.2g} m RMS against {theirs:.2g} m of {label}"
            for name, ours, theirs, label in told
        )
        + ".",
    )


def _dead_time(contest: Contest) -> Finding:
    """What knowing the dead time is worth on the eight, for every model that flew without, too."""
    gains = {
        model: contest[EIGHT.name, Contestant(model, told=False)].rms
        / contest[EIGHT.name, Contestant(model)].rms
        for model in PAPERS
    }
    told = ", ".join(f"{LOOKS[model].label} {gain:.2g} ×" for model, gain in gains.items())
    return Finding(
        "asked",
        "Predicting past the dead time helps every model.",
        min(gains.values()) > 1.0,
        f"Error on the eight without it, against with it: {told}.",
    )


def _in_time(exchange: Exchange) -> Finding:
    p99 = float(np.percentile(exchange.whole_ms, 99))
    return Finding(
        "asked",
        f"In its own process our model is solved within {_WHOLE_MS:.0f} ms at 50 Hz.",
        p99 < _WHOLE_MS and exchange.troubles == 0,
        f"p99 of the whole answer, data exchange included, {p99:.2g} ms; {exchange.troubles} of"
        " the requests were late or failed.",
    )
