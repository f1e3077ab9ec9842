"""The numbers of the study: solve times, cold starts, errors in flight, the exchange."""

import numpy as np

from companion.study.nmpc.cold_start import STATES, Counts
from companion.study.nmpc.contest import CIRCLE, EIGHT, Contest
from companion.study.nmpc.contestants import LOOKS, MODELS, SQP_ITERATIONS, Contestant
from companion.study.nmpc.exchange import Exchange
from companion.study.outcome import Cell, Table


def time_table(contest: Contest) -> Table:
    """Solve times of every model, once an iteration and once to the end."""
    rows: list[tuple[Cell, ...]] = []
    for model in MODELS:
        single = contest[EIGHT.name, Contestant(model)]
        whole = contest[EIGHT.name, Contestant(model, SQP_ITERATIONS)]
        rows.append(
            (
                LOOKS[model].label,
                single.solve_ms(50),
                single.solve_ms(99),
                whole.solve_ms(50),
                whole.solve_ms(99),
                float(np.mean(whole.iterations)),
                int(max(whole.iterations)),
            )
        )
    return Table(
        "nmpc",
        "Processor time of the solver on the figure-eight, all models in turn: the real-time"
        f" iteration, and the SQP to its tolerance or to {SQP_ITERATIONS} iterations.",
        (
            "model",
            "one iteration: p50, ms",
            "one iteration: p99, ms",
            "to the end: p50, ms",
            "to the end: p99, ms",
            "iterations: mean",
            "iterations: most",
        ),
        tuple(rows),
    )


def cold_start_table(counts: Counts) -> Table:
    """Iterations from every state."""
    return Table(
        "nmpc-cold-start",
        "SQP iterations to the tolerance, the vehicle found like this while it should be on the"
        " circle at 5 m/s; the first guess is the circle.",
        ("model", *STATES),
        tuple((LOOKS[model].label, *of_model.values()) for model, of_model in counts.items()),
    )


def error_table(contest: Contest) -> Table:
    """Errors in flight by model and by whether it knows the dead time."""
    rows: list[tuple[Cell, ...]] = []
    for (task, who), eight in contest.items():
        if task != EIGHT.name or who.iterations > 1:
            continue
        circle = contest[CIRCLE.name, who]
        told = "known" if who.told else "not known"
        rows.append((who.label, told, circle.rms, circle.worst, eight.rms, eight.worst))
    return Table(
        "nmpc-error",
        "Distance from the trajectory in flight from 4 s on, one iteration a solve at 50 Hz: after"
        " the standing start into the circle, and on the figure-eight.",
        (
            "model",
            "dead time",
            "circle: RMS, m",
            "circle: largest, m",
            "eight: RMS, m",
            "eight: largest, m",
        ),
        tuple(rows),
    )


def exchange_table(exchange: Exchange) -> Table:
    """The solver as a flight meets it."""
    times = (("whole answer", exchange.whole_ms), ("of it in the process", exchange.solve_ms))
    return Table(
        "nmpc-exchange",
        "Our model's solver in its own process at 50 Hz, one iteration a solve: from the request to"
        " the answer, prediction, reference and data exchange included.",
        ("what", "p50, ms", "p99, ms", "largest, ms"),
        tuple(
            (name, *(float(np.percentile(ms, share)) for share in (50, 99, 100)))
            for name, ms in times
        ),
    )


def series(contest: Contest) -> Table:
    """Every flight, every period."""
    return Table(
        "nmpc-flights",
        "All flights.",
        (
            "task",
            "model",
            "most iterations",
            "dead time known",
            "period",
            "error, m",
            "solve, s",
        ),
        tuple(
            (task, who.label, who.iterations, int(who.told), k, error, seconds)
            for (task, who), flight in contest.items()
            for k, (error, seconds) in enumerate(zip(flight.errors, flight.seconds, strict=True))
        ),
    )
