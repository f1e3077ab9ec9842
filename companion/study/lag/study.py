"""The study `lag`: flights, tables, and section of the page."""

from itertools import product

from companion.recording.measurements.second_order import SecondOrderModel
from companion.study.lag.figure import CAPTION, draw_figure
from companion.study.lag.findings import make_findings
from companion.study.lag.flights import (
    DEAD_TIMES_MS,
    EXAMPLE_ERRORS_HZ,
    EXAMPLE_LOOP,
    FINE_ERRORS,
    LAGS_MS,
    METHODS,
    NO_ERROR,
    RATES_HZ,
    SHOWN_RATE_HZ,
    CompleteLoopFlights,
    DelayMismatch,
    Example,
    Grid,
    GridCell,
    Score,
    fly_complete_loop,
    fly_example,
    fly_grid,
    in_percent,
    score,
)
from companion.study.measures import (
    fit_cells,
    fit_second_order,
    largest_deviation,
    largest_tilt_rate,
    second_order_path,
)
from companion.study.methods import Method
from companion.study.outcome import Outcome, Row, Table, Tick
from companion.study.step import Response

PROGRESS_STEPS = len(DEAD_TIMES_MS) * len(LAGS_MS) + 1 + len(RATES_HZ)


_FittedModel = tuple[SecondOrderModel, float]
"""The second-order model fitted to a response, and the largest deviation from it."""


def run(tick: Tick) -> Outcome:
    """Fly the step of figure 2 over dead times, lags and sample rates, with true and wrong delays.

    Args:
        tick: called `PROGRESS_STEPS` times.
    """
    grid = fly_grid(tick)
    tick("the example")
    example = fly_example()
    complete = fly_complete_loop(tick)
    fitted_models = {
        method: _fit_model(response) for method, response in complete.shown_responses.items()
    }
    deviations = {method: deviation for method, (_, deviation) in fitted_models.items()}
    return Outcome(
        name="lag",
        title="Lag: behind a rate loop with dead time and lag",
        conditions=(
            "The step of figure 2, p = 5 s⁻¹, through a rate loop with a dead time of 0 to 80 ms"
            " and a first-order lag of 10 to 60 ms, planners at 50 to 250 Hz. The example has a"
            f" dead time of {EXAMPLE_LOOP.dead_time_ms} ms and a lag of {EXAMPLE_LOOP.lag_ms} ms."
            " model-following is given lag and dead time, either the true ones or with the errors"
            " stated. Further below is the complete inner loop of figure 5 with 20 ms of transport"
            " delay; there model-following is given a first-order fit."
        ),
        figure=draw_figure(grid, example, complete),
        caption=CAPTION,
        tables=(
            _example_table(example),
            _errors_table(
                "lag-wrong-knowledge",
                f"Cross-track of model-following at {EXAMPLE_ERRORS_HZ:.0f} Hz in the example, by"
                " the error of the assumed lag (rows) and dead time (columns).",
                example.model_following_scores,
            ),
            _worst_table(grid),
            _fit_table(complete, fitted_models),
            _rates_table(complete),
            _errors_table(
                "lag-inner-loop-wrong-knowledge",
                "Cross-track of model-following with the complete inner loop at"
                f" {SHOWN_RATE_HZ:.0f} Hz, by the error of its lags (rows) and dead times (columns)"
                " against those fitted to the inner loop.",
                complete.by_rate[SHOWN_RATE_HZ].model_following_scores,
            ),
        ),
        findings=make_findings(grid, example, complete, deviations),
        series=(*_grid_series(grid), _complete_series(complete)),
    )


def _fit_model(response: Response) -> _FittedModel:
    fit = fit_second_order(response.step, response.at_heading(0))
    model = second_order_path(response.step, fit, response.step.time)
    return fit, float(largest_deviation(response, model)[0])


def _example_table(example: Example) -> Table:
    """Scores of every method by sample rate, and of model-following with a limited tilt rate."""
    rows = []
    for rate, responses in example.unlimited_responses.items():
        labelled_responses = {method.label: response for method, response in responses.items()}
        limited_response = example.rate_limited_responses[rate]
        labelled_responses["model-following, W_M = π/2"] = limited_response
        rows += [
            {
                "method": label,
                "rate, Hz": round(rate),
                **score(response).cells,
                "largest √(ω_x²+ω_y²), rad/s": largest_tilt_rate(response),
            }
            for label, response in labelled_responses.items()
        ]
    caption = (
        f"The example: dead time {EXAMPLE_LOOP.dead_time_ms} ms, lag {EXAMPLE_LOOP.lag_ms} ms."
    )
    return Table("lag", caption, tuple(rows))


def _errors_table(name: str, caption: str, scores: dict[DelayMismatch, Score]) -> Table:
    """Cross-track error by the error of the lag (rows) and of the dead time (columns)."""
    return Table(
        name,
        caption,
        tuple(
            {"lag": in_percent(lag)}
            | {
                f"dead time {in_percent(error)}": scores[DelayMismatch(lag, error)].cross_track
                for error in FINE_ERRORS
            }
            for lag in FINE_ERRORS
        ),
    )


def _worst_table(grid: Grid) -> Table:
    """Cross-track errors of model-following with the worst delays, and of the best other method."""
    dead_times = sorted({cell.dead_time_ms for cell in grid})
    rows: list[Row] = []
    for rate, lag in product(RATES_HZ, sorted({cell.lag_ms for cell in grid})):
        flown = {dead_time: grid[GridCell(rate, dead_time, lag)] for dead_time in dead_times}
        worst = {f"worst, {ms} ms": each.worst_cross_track for ms, each in flown.items()}
        best_others = {
            f"best other, {ms} ms": each.best_other_cross_track for ms, each in flown.items()
        }
        rows.append({"rate, lag": f"{rate:.0f} Hz, {lag} ms", **worst, **best_others})
    return Table(
        "lag-worst-knowledge",
        "Cross-track over the grid, by rate and lag (rows) and dead time (columns): model-following"
        " with lag and dead time wrong by ±50 %, the worst combination, and the best of the other"
        " methods, which use neither.",
        tuple(rows),
    )


def _fit_table(complete: CompleteLoopFlights, fitted_models: dict[Method, _FittedModel]) -> Table:
    """Score and fitted model of every method at `SHOWN_RATE_HZ`."""
    scores = complete.by_rate[SHOWN_RATE_HZ].by_method
    return Table(
        "lag-inner-loop",
        f"The complete inner loop with 20 ms of transport delay, {SHOWN_RATE_HZ:.0f} Hz, heading 0,"
        " and the second-order model with dead time fitted to each response.",
        tuple(
            {
                "method": method.label,
                **scores[method].cells,
                **fit_cells(fit),
                "largest deviation from this model": deviation,
            }
            for method, (fit, deviation) in fitted_models.items()
        ),
    )


def _rates_table(complete: CompleteLoopFlights) -> Table:
    """Cross-track error of every method by sample rate; model-following also with wrong delays."""
    comparison_by_column = {
        f"{rate:.0f} Hz": comparison for rate, comparison in complete.by_rate.items()
    }
    rows: list[Row] = [
        {"method": m.label}
        | {
            column: comparison.by_method[m].cross_track
            for column, comparison in comparison_by_column.items()
        }
        for m in METHODS
    ]
    worst_cross_tracks = {
        column: comparison.worst_cross_track for column, comparison in comparison_by_column.items()
    }
    label = "model-following, lag and dead time wrong by the worst error"
    return Table(
        "lag-inner-loop-rates",
        "Cross-track with the complete inner loop by sample rate. In the last row the lag and"
        " dead time of model-following are wrong by up to ±50 %; the worst combination is shown.",
        (*rows, {"method": label, **worst_cross_tracks}),
    )


def _grid_series(grid: Grid) -> tuple[Table, Table]:
    """Every flight of the grid: a table with true, and one with wrong lag and dead time."""

    def conditions(cell: GridCell) -> Row:
        times = {"dead time, ms": cell.dead_time_ms, "lag, ms": cell.lag_ms}
        return {**times, "rate, Hz": cell.rate_hz}

    return (
        Table(
            "lag-grid",
            "All methods over the grid, model-following with the true lag and dead time.",
            tuple(
                {"method": method.label, **conditions(cell), **method_score.cells}
                for cell, comparison in grid.items()
                for method, method_score in comparison.by_method.items()
            ),
        ),
        Table(
            "lag-grid-wrong-knowledge",
            "model-following over the grid, with a wrong lag and dead time.",
            tuple(
                {**conditions(cell), **error.cells, **method_score.cells}
                for cell, comparison in grid.items()
                for error, method_score in comparison.model_following_scores.items()
                if error != NO_ERROR
            ),
        ),
    )


def _complete_series(complete: CompleteLoopFlights) -> Table:
    """Cross-track error of model-following for every delay error at every sample rate."""
    return Table(
        "lag-inner-loop-beliefs",
        "Cross-track of model-following with the complete inner loop, by rate and error.",
        tuple(
            {"rate, Hz": rate, **error.cells, "cross-track": method_score.cross_track}
            for rate, comparison in complete.by_rate.items()
            for error, method_score in comparison.model_following_scores.items()
        ),
    )
