"""The figure of the study `lag`: example, grid, wrong lag and dead time, complete inner loop."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from companion.study.drawing import draw_line, draw_plane
from companion.study.lag.flights import (
    EXAMPLE_ERRORS_HZ,
    FINE_ERRORS,
    METHODS,
    RATES_HZ,
    SHOWN_RATE_HZ,
    Comparison,
    CompleteLoopFlights,
    DelayMismatch,
    Example,
    Grid,
    GridCell,
    Score,
    in_percent,
)
from companion.study.methods import LIMIT_STYLE, MODEL_FOLLOWING_METHOD, LineStyle, Method
from companion.study.step import FIGURE_2, Response

CAPTION = (
    "First row: paths and distance from the line in the example, at 100 Hz. Second row: cross-track"
    " by dead time (lag 25 ms) and by lag (dead time 40 ms); the upper edge of the shaded area is"
    " model-following with the worst error of its assumed lag and dead time. Third row, at three"
    " sample rates: the cross-track of model-following with this worst error, divided by the"
    " cross-track of the best other method. Red: above 1, where the other method is straighter."
    " Fourth row: model-following by the error of its assumed lag and dead time, in the example and"
    " with the complete inner loop. Last row: paths with the complete inner loop, and cross-track"
    " there by sample rate."
)

_CROSS_TRACK_LABEL = "largest distance from the line"
_WORSE_COLOUR = "#A33C00"
"""Colour of cells where another method has less cross-track error than model-following, and of the
verdict `does not hold` on the page."""
_CUT_HZ, _CUT_LAG_MS, _CUT_DEAD_TIME_MS = 100.0, 25, 40
"""Sample rate, fixed lag and fixed dead time of the two plots in the second row."""
_SHADE: LineStyle = {
    "facecolor": (MODEL_FOLLOWING_METHOD.colour, 0.15),
    "edgecolor": MODEL_FOLLOWING_METHOD.colour,
    "linewidth": 0.6,
}
_LAG_ERROR_STYLES: dict[float, LineStyle] = {
    -0.5: {"linestyle": ":", "marker": "v", "markersize": 6.0},
    -0.3: {"linestyle": ":", "marker": "v", "markersize": 3.5},
    0.0: {"linestyle": "-", "marker": "o", "markersize": 3.5},
    0.3: {"linestyle": "--", "marker": "^", "markersize": 3.5},
    0.5: {"linestyle": "--", "marker": "^", "markersize": 6.0},
}
"""Line style of each error of the lag."""
_PANELS: list[Any] = [  # Any, because matplotlib has its own type for nested lists
    ["path"] * 3 + ["time"] * 3,
    ["dead time"] * 3 + ["lag"] * 3,
    ["50"] * 2 + ["100"] * 2 + ["250"] * 2,
    ["example errors"] * 3 + ["loop errors"] * 3,
    ["loop path"] * 3 + ["loop rate"] * 3,
]


def draw_figure(grid: Grid, example: Example, complete: CompleteLoopFlights) -> Figure:
    """Draw the figure that `CAPTION` describes."""
    figure = Figure(figsize=(9.2, 15.5), layout="constrained")
    panels: dict[str, Any] = figure.subplot_mosaic(_PANELS)
    responses = example.unlimited_responses[_CUT_HZ]
    _draw_paths(panels["path"], responses)
    _draw_distance(panels["time"], responses)
    dead_times, lags = _grid_values(grid)
    over_dead_time = [GridCell(_CUT_HZ, dead_time, _CUT_LAG_MS) for dead_time in dead_times]
    _draw_cross_track_by(panels["dead time"], grid, over_dead_time, dead_times, "dead time")
    over_lag = [GridCell(_CUT_HZ, _CUT_DEAD_TIME_MS, lag) for lag in lags]
    _draw_cross_track_by(panels["lag"], grid, over_lag, lags, "lag")
    for rate in RATES_HZ:
        _draw_ratios(panels[f"{rate:.0f}"], grid, rate)
    _draw_errors(panels["example errors"], example.model_following_scores)
    panels["example errors"].set_title(
        f"Wrong lag and dead time, the example, {EXAMPLE_ERRORS_HZ:.0f} Hz"
    )
    _draw_inner_loop_errors(panels["loop errors"], complete)
    _draw_paths(panels["loop path"], complete.shown_responses)
    panels["loop path"].set_title(f"Path, complete inner loop, {SHOWN_RATE_HZ:.0f} Hz")
    _draw_rates(panels["loop rate"], complete)
    return figure


def _grid_values(grid: Grid) -> tuple[list[int], list[int]]:
    """The dead times and the lags of the grid, ms."""
    return sorted({cell.dead_time_ms for cell in grid}), sorted({cell.lag_ms for cell in grid})


def _draw_paths(axes: Axes, responses: dict[Method, Response]) -> None:
    draw_plane(axes, [(m, m.label, r.at_heading(0)) for m, r in responses.items()], FIGURE_2)


def _draw_distance(axes: Axes, responses: dict[Method, Response]) -> None:
    for method, response in responses.items():
        distance = response.at_heading(0)[:, 1] - FIGURE_2.target.east
        draw_line(axes, response.step.time, distance, method.line_style, method.label)
    axes.set(title="Distance from the line", xlabel="time, s", ylabel="$a_E$ + 0.5", xlim=(0, 1.5))
    axes.legend(ncols=2)


def _draw_cross_track_by(
    axes: Axes, grid: Grid, cells: list[GridCell], values_ms: list[int], quantity: str
) -> None:
    """Draw the cross-track error of every method over the lag or over the dead time.

    Args:
        axes: the panel.
        grid: all flights of the grid.
        cells: cells of the grid that are shown.
        values_ms: lag or dead time of each cell, ms.
        quantity: "lag" or "dead time".
    """
    _draw_cross_tracks(axes, values_ms, [grid[cell] for cell in cells])
    axes.set(
        title=f"Cross-track by {quantity}, {_CUT_HZ:.0f} Hz", xlabel=f"{quantity}, ms", yscale="log"
    )
    axes.legend(loc="center right")


def _draw_cross_tracks(
    axes: Axes, values: Sequence[float], comparisons: Sequence[Comparison]
) -> None:
    """Draw the cross-track error of every method over `values`.

    `values`: lag, dead time or sample rate of each comparison.
    """
    for method in METHODS:
        cross_tracks = [comparison.by_method[method].cross_track for comparison in comparisons]
        axes.plot(values, cross_tracks, marker=".", **method.line_style)
    axes.fill_between(
        values,
        [comparison.cross_track for comparison in comparisons],
        [comparison.worst_cross_track for comparison in comparisons],
        **_SHADE,
        label="model-following, wrong lag and dead time",
    )
    axes.set_ylabel(_CROSS_TRACK_LABEL)


def _draw_ratios(axes: Axes, grid: Grid, rate_hz: float) -> None:
    """Draw `Comparison.ratio` of each cell of the grid at one sample rate."""
    dead_times, lags = _grid_values(grid)
    ratios = np.array(
        [
            [grid[GridCell(rate_hz, dead_time, lag)].ratio for dead_time in dead_times]
            for lag in lags
        ]
    )
    shades = colormaps["Purples"].with_extremes(over=_WORSE_COLOUR)
    axes.imshow(ratios, cmap=shades, vmin=0.0, vmax=1.0, origin="lower", aspect="auto")
    for (row, column), ratio in np.ndenumerate(ratios):
        colour = "white" if ratio > 0.6 else "black"
        axes.text(column, row, f"{ratio:.2f}", ha="center", va="center", color=colour)
    axes.grid(visible=False)
    axes.set(
        title=f"Model-following (worst error)\n/ best other, {rate_hz:.0f} Hz",
        xlabel="dead time, ms",
        ylabel="lag, ms",
        xticks=range(len(dead_times)),
        xticklabels=[str(value) for value in dead_times],
        yticks=range(len(lags)),
        yticklabels=[str(value) for value in lags],
    )


def _draw_errors(axes: Axes, scores: dict[DelayMismatch, Score]) -> None:
    """Draw the cross-track error over the error of the dead time, a line for each lag error."""
    errors = [100.0 * error for error in FINE_ERRORS]
    for lag, style in _LAG_ERROR_STYLES.items():
        cross_tracks = [
            scores[DelayMismatch(lag, dead_time)].cross_track for dead_time in FINE_ERRORS
        ]
        line_style = {"color": MODEL_FOLLOWING_METHOD.colour, "linewidth": 1.3, **style}
        axes.plot(errors, cross_tracks, label=f"lag {in_percent(lag)}", **line_style)
    axes.set(
        xlabel="error of the assumed dead time, %", ylabel=_CROSS_TRACK_LABEL, ylim=(0.0, None)
    )
    axes.legend(ncols=2)


def _draw_inner_loop_errors(axes: Axes, complete: CompleteLoopFlights) -> None:
    comparison = complete.by_rate[SHOWN_RATE_HZ]
    _draw_errors(axes, comparison.model_following_scores)
    cross_track = comparison.best_other_cross_track
    axes.axhline(cross_track, **LIMIT_STYLE)
    label = f"{comparison.best_other.label}, the best of the others"
    axes.annotate(label, (50, cross_track), ha="right", va="bottom")
    axes.set(
        title=f"Wrong lag and dead time, complete inner loop, {SHOWN_RATE_HZ:.0f} Hz",
        ylim=(0.0, 1.1 * max(cross_track, comparison.worst_cross_track)),
    )


def _draw_rates(axes: Axes, complete: CompleteLoopFlights) -> None:
    rates = list(complete.by_rate)
    _draw_cross_tracks(axes, rates, list(complete.by_rate.values()))
    axes.set(
        title="Cross-track by sample rate, complete inner loop",
        xlabel="sample rate, Hz",
        xscale="log",
        xticks=rates,
        xticklabels=[f"{rate:.0f}" for rate in rates],
        ylim=(0.0, None),
    )
    axes.minorticks_off()
    axes.legend(loc="center right", bbox_to_anchor=(1.0, 0.68))
