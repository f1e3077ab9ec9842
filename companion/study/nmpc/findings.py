"""The findings of the study `nmpc`: statements, and whether the results support them."""

from collections.abc import Sequence
from math import isinf

import numpy as np

from companion.study.nmpc.flights import Flights
from companion.study.nmpc.models import ModelName
from companion.study.nmpc.timing import STATES, ColdStarts, ProcessTimes
from companion.study.nmpc.variants import (
    CIRCLE,
    EIGHT,
    MAX_ITERATIONS,
    MODELS,
    RATE_HZ,
    STYLES,
    UNLIMITED_MODELS,
    Variant,
)
from companion.study.outcome import Claimant, Finding

_SETTLED_ERROR_M = 0.1
"""A flight has settled if its errors in the last 2 s are at most this, m."""
_LAST_PERIODS = round(2.0 * RATE_HZ)
"""Number of solver periods in the last 2 s of a flight."""
_MAX_ANSWER_MS = 10.0
"""Required 99th percentile of the solver process's answer time, ms; half a period."""


def make_findings(flights: Flights, counts: ColdStarts, times: ProcessTimes) -> tuple[Finding, ...]:
    """All findings."""
    return (
        _solve_time_finding("paper", ("euler", "quaternion"), flights),
        _solve_time_finding("ours", ("euler-reduced",), flights),
        _cold_start_finding(counts),
        _settling_finding("limited", flights),
        _settling_finding("proposed", flights),
        _dead_time_finding(flights),
        _smallest_error_finding(flights),
        _answer_time_finding(times),
    )


def _solve_time_finding(
    claimant: Claimant, other_models: Sequence[ModelName], flights: Flights
) -> Finding:
    """Whether the proposed model is solved faster than the others, with one or more iterations."""
    ratios = {
        (model, iterations): _median_ms(model, iterations, flights)
        / _median_ms("proposed", iterations, flights)
        for model in other_models
        for iterations in (1, MAX_ITERATIONS)
    }
    medians = "; ".join(
        f"{STYLES[model].label} takes {ratios[model, 1]:.2f} times as long for one iteration,"
        f" {ratios[model, MAX_ITERATIONS]:.2f} times to the end"
        for model in other_models
    )
    names = " and ".join(STYLES[model].label for model in other_models)
    return Finding(
        claimant,
        f"The proposed model is solved faster than {names}.",
        min(ratios.values()) > 1.0,
        f"Medians: {medians}.",
    )


def _median_ms(model: ModelName, iterations: int, flights: Flights) -> float:
    return flights[EIGHT.name, Variant(model, iterations)].solve_ms(50)


def _cold_start_finding(counts: ColdStarts) -> Finding:
    reached_counts = {m: sum(not isinf(count) for count in counts[m].values()) for m in MODELS}
    largest_other_count = max(reached_counts[model] for model in UNLIMITED_MODELS)
    reached_text = ", ".join(f"{STYLES[model].label} {reached_counts[model]}" for model in MODELS)
    return Finding(
        "ours",
        "With limits as constraints the solver converges from more states.",
        reached_counts["limited"] > largest_other_count,
        f"States out of {len(STATES)} from which it reaches the tolerance: {reached_text}.",
    )


def _settling_finding(model: ModelName, flights: Flights) -> Finding:
    flight = flights[CIRCLE.name, Variant(model)]
    last_error = max(flight.errors[-_LAST_PERIODS:])
    return Finding(
        "ours",
        f"From a standing start, {STYLES[model].label} settles on the circle within 4 s.",
        last_error < _SETTLED_ERROR_M,
        f"The error is {max(flight.errors):.2g} m at most, and {last_error:.2g} m in the last 2 s"
        f" of 6 s (bound {_SETTLED_ERROR_M:g} m).",
    )


def _smallest_error_finding(flights: Flights) -> Finding:
    comparisons = []
    for task in (CIRCLE, EIGHT):
        errors = {model: flights[task.name, Variant(model)].rms for model in MODELS}
        best_other = min((errors[model], STYLES[model].label) for model in UNLIMITED_MODELS)
        comparisons.append((task.name, errors["limited"], *best_other))
    return Finding(
        "ours",
        "If all models know the dead time, ours has the smallest error on both trajectories.",
        all(ours < theirs for _, ours, theirs, _ in comparisons),
        "; ".join(
            f"{name}: {ours:.2g} m RMS against {theirs:.2g} m of {label}"
            for name, ours, theirs, label in comparisons
        )
        + ".",
    )


def _dead_time_finding(flights: Flights) -> Finding:
    """Whether models that know the dead time have the smaller error on the figure-eight."""
    error_ratios = {
        model: flights[EIGHT.name, Variant(model, knows_dead_time=False)].rms
        / flights[EIGHT.name, Variant(model)].rms
        for model in UNLIMITED_MODELS
    }
    ratios_text = ", ".join(
        f"{STYLES[model].label} {error_ratio:.2g} ×" for model, error_ratio in error_ratios.items()
    )
    return Finding(
        "ours",
        "Predicting past the dead time helps every model.",
        min(error_ratios.values()) > 1.0,
        "Error on the figure-eight without this prediction, divided by the error with it:"
        f" {ratios_text}.",
    )


def _answer_time_finding(times: ProcessTimes) -> Finding:
    p99 = float(np.percentile(times.answer_ms, 99))
    return Finding(
        "ours",
        f"The solver process answers within {_MAX_ANSWER_MS:.0f} ms at 50 Hz.",
        p99 < _MAX_ANSWER_MS and times.bad_answer_count == 0,
        f"p99 of the answer time, data exchange included, {p99:.2g} ms; {times.bad_answer_count} of"
        " the answers were late, failed or implausible.",
    )
