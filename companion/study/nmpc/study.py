"""The study `nmpc`: flights, tables, figure, and section of the page."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from companion.study.drawing import draw_line, new_figure
from companion.study.methods import REFERENCE_STYLE
from companion.study.nmpc.findings import make_findings
from companion.study.nmpc.flights import FLIGHT_S, Flights, fly_all
from companion.study.nmpc.timing import (
    ColdStarts,
    ProcessTimes,
    count_iterations,
    time_process,
)
from companion.study.nmpc.variants import (
    CIRCLE,
    EIGHT,
    MAX_ITERATIONS,
    MODELS,
    RATE_HZ,
    STYLES,
    Task,
    Variant,
)
from companion.study.outcome import Outcome, Row, Table, Tick

PROGRESS_STEPS = FLIGHT_S + 2

_CAPTION = (
    "All models know the dead time; one iteration per solve. The standing start into the circle"
    " seen from above, and its error over time; the error on the figure-eight; and the distribution"
    " of the solve times on the figure-eight, with one iteration (thin) and to the end (thick)."
)


def run(tick: Tick) -> Outcome:
    """Count the iterations of cold starts, time the solver process, and fly all models.

    Raises:
        ChildProcessError: the solver process does not start.
    """
    tick("cold starts")
    counts = count_iterations()
    tick("the solver process")
    times = time_process()
    flights = fly_all(tick)
    return Outcome(
        name="nmpc",
        title="Predictive control: solve time and position error of each prediction model",
        conditions=(
            "A horizon of 1 s in 20 steps, the same cost for all models, Gauss–Newton SQP by"
            " CasADi with HPIPM, at 50 Hz. The vehicle is a point mass with 1 s⁻¹ of drag, flown"
            " by model-following (p = 5 s⁻¹, 50° of tilt, 120 °/s) behind a rate loop with 45 ms"
            " of dead time and 25 ms of lag. The models (34), (37) and (39) are the paper's, with"
            " drag; their only limit is the thrust. Ours adds the limits of tilt and rate and the"
            " second-order response. Solve times depend on this machine and its load."
        ),
        figure=_draw_figure(flights),
        caption=_CAPTION,
        tables=(
            _time_table(flights),
            _cold_start_table(counts),
            _error_table(flights),
            _process_table(times),
        ),
        findings=make_findings(flights, counts, times),
        series=(_flights_table(flights),),
    )


def _time_table(flights: Flights) -> Table:
    """Solve times of every model, with one iteration and with iterations to the tolerance."""
    rows: list[Row] = []
    for model in MODELS:
        one_iteration = flights[EIGHT.name, Variant(model)]
        to_tolerance = flights[EIGHT.name, Variant(model, MAX_ITERATIONS)]
        rows.append(
            {
                "model": STYLES[model].label,
                "one iteration: p50, ms": one_iteration.solve_ms(50),
                "one iteration: p99, ms": one_iteration.solve_ms(99),
                "to the end: p50, ms": to_tolerance.solve_ms(50),
                "to the end: p99, ms": to_tolerance.solve_ms(99),
                "iterations: mean": float(np.mean(to_tolerance.iterations)),
                "iterations: most": int(max(to_tolerance.iterations)),
            }
        )
    return Table(
        "nmpc",
        "Processor time of the solver on the figure-eight, all models in turn: for one"
        " iteration, and to the end, which is the tolerance of the SQP or "
        f"{MAX_ITERATIONS} iterations.",
        tuple(rows),
    )


def _cold_start_table(counts: ColdStarts) -> Table:
    """Iterations of every model from every state."""
    return Table(
        "nmpc-cold-start",
        "SQP iterations to the tolerance, by the state of the vehicle while it should be on the"
        " circle at 5 m/s. The first guess is the circle.",
        tuple({"model": STYLES[model].label, **by_state} for model, by_state in counts.items()),
    )


def _error_table(flights: Flights) -> Table:
    """Errors in flight, by model and by whether it knows the dead time."""
    rows: list[Row] = []
    for (task, variant), eight in flights.items():
        if task != EIGHT.name or variant.iterations > 1:
            continue
        circle = flights[CIRCLE.name, variant]
        rows.append(
            {
                "model": variant.label,
                "dead time": "known" if variant.knows_dead_time else "not known",
                "circle: RMS, m": circle.rms,
                "circle: largest, m": circle.largest_error,
                "eight: RMS, m": eight.rms,
                "eight: largest, m": eight.largest_error,
            }
        )
    return Table(
        "nmpc-error",
        "Distance from the trajectory from 4 s on, one iteration per solve at 50 Hz: after"
        " the standing start into the circle, and on the figure-eight.",
        tuple(rows),
    )


def _process_table(times: ProcessTimes) -> Table:
    """Answer times of the solver process."""
    rows = {"request to answer": times.answer_ms, "without data exchange": times.computing_ms}
    percentiles = {"p50, ms": 50, "p99, ms": 99, "largest, ms": 100}
    return Table(
        "nmpc-exchange",
        "Our model's solver in its own process at 50 Hz, one iteration per solve: from the"
        " request to the answer, with prediction, reference and data exchange.",
        tuple(
            {"what": what}
            | {title: float(np.percentile(ms, share)) for title, share in percentiles.items()}
            for what, ms in rows.items()
        ),
    )


def _flights_table(flights: Flights) -> Table:
    """Error and solve time in every period of every flight."""
    return Table(
        "nmpc-flights",
        "All flights.",
        tuple(
            {
                "task": task,
                "model": variant.label,
                "most iterations": variant.iterations,
                "dead time known": int(variant.knows_dead_time),
                "period": period,
                "error, m": error,
                "solve, s": seconds,
            }
            for (task, variant), flight in flights.items()
            for period, (error, seconds) in enumerate(
                zip(flight.errors, flight.solve_s, strict=True)
            )
        ),
    )


def _draw_figure(flights: Flights) -> Figure:
    """Draw the figure that `_CAPTION` describes."""
    figure, ((path, eight), (circle, times)) = new_figure(2, 2)
    _draw_paths(path, flights)
    _draw_errors(circle, flights, CIRCLE, "Error after the standing start")
    _draw_errors(eight, flights, EIGHT, "Error on the figure-eight")
    _draw_times(times, flights)
    circle.set(yscale="log", ylim=(1e-3, None))
    circle.legend(loc="lower left")
    return figure


def _draw_paths(axes: Axes, flights: Flights) -> None:
    for model in MODELS:
        north, east, _ = np.array(flights[CIRCLE.name, Variant(model)].path).T
        axes.plot(east, north, **STYLES[model].line_style)
    start_position = CIRCLE.trajectory.at(CIRCLE.begin).position
    times = CIRCLE.begin + np.linspace(0.0, 2.0 * np.pi, 100)
    reference = np.array([CIRCLE.trajectory.at(float(t)).position for t in times]) - start_position
    axes.plot(reference[:, 1], reference[:, 0], **REFERENCE_STYLE)
    axes.plot(0.0, 0.0, "o", color="black", markersize=4)
    low, high = reference.min(axis=0) - 5.0, reference.max(axis=0) + 5.0
    axes.set(
        title="Standing start into the circle (● start)",
        xlabel="east, m",
        ylabel="north, m",
        aspect="equal",
        xlim=(low[1], high[1]),
        ylim=(low[0], high[0]),
    )


def _draw_errors(axes: Axes, flights: Flights, task: Task, title: str) -> None:
    for model in MODELS:
        errors = np.array(flights[task.name, Variant(model)].errors)
        time = (np.arange(len(errors)) + 1) / RATE_HZ
        draw_line(axes, time, errors, STYLES[model].line_style, STYLES[model].label)
    axes.set(title=title, xlabel="time, s", ylabel="distance, m")


def _draw_times(axes: Axes, flights: Flights) -> None:
    for model in MODELS:
        for iterations, width in ((1, 1.0), (MAX_ITERATIONS, 2.5)):
            times = np.sort(flights[EIGHT.name, Variant(model, iterations)].solve_s)
            share = (np.arange(len(times)) + 1) / len(times)
            axes.plot(1e3 * times, share, **{**STYLES[model].line_style, "linewidth": width})
    axes.set(
        title="Processor time of a solve",
        xlabel="time, ms",
        ylabel="share of the solves",
        xlim=(0.0, None),
        ylim=(0.0, 1.0),
    )
