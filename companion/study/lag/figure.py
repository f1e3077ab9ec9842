"""The figure of the study: the case, the grid, wrong knowledge, the complete inner loop."""

from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from companion.study.drawing import draw, draw_plane
from companion.study.lag.belief import FINER, RIGHT, Belief, in_percent
from companion.study.lag.case import WRONG_AT_HZ, Case
from companion.study.lag.complete import TOLD_AT_HZ, Complete
from companion.study.lag.flown import METHODS, RATES_HZ
from companion.study.lag.grid import DEAD_TIMES_MS, LAGS_MS, Cell, Grid
from companion.study.methods import FOLLOWING, LIMIT, Line, Method
from companion.study.step import FIGURE_2, Response

CAPTION = (
    "First row: paths and distance from the line in the case in full, at 100 Hz. Second row:"
    " cross-track over the dead time (lag 25 ms) and over the lag (dead time 40 ms), shaded up to"
    " model-following with the worst of the wrong times. Third row: cross-track of model-following"
    " with the worst of the wrong times, in shares of that of the best other method, at three"
    " sample rates; below 1 it is the straighter, elsewhere the cell is red. Fourth row:"
    " model-following with wrong times, in the case in full and with the complete inner loop. Last"
    " row: paths with the complete inner loop, and cross-track there over the sample rate."
)

_ENDS = np.array([FIGURE_2.start, FIGURE_2.target])
_ACROSS = "largest distance from the line"
_WORSE = "#A33C00"
"""Where another method is the straighter; the page's own colour of what does not hold."""
_AT_HZ, _AT_LAG_MS, _AT_DEAD_TIME_MS = 100.0, 25, 40
"""Where the grid is cut for the second row."""
_SHADE: Line = {
    "facecolor": (FOLLOWING.colour, 0.15),
    "edgecolor": FOLLOWING.colour,
    "linewidth": 0.6,
}
_BY_LAG: dict[float, Line] = {
    -0.5: {"linestyle": ":", "marker": "v", "markersize": 6.0},
    -0.3: {"linestyle": ":", "marker": "v", "markersize": 3.5},
    0.0: {"linestyle": "-", "marker": "o", "markersize": 3.5},
    0.3: {"linestyle": "--", "marker": "^", "markersize": 3.5},
    0.5: {"linestyle": "--", "marker": "^", "markersize": 6.0},
}
"""The look of each error of the lag."""
_PANELS: list[Any] = [  # matplotlib types it as a nested list of its own
    ["path"] * 3 + ["time"] * 3,
    ["dead time"] * 3 + ["lag"] * 3,
    ["50"] * 2 + ["100"] * 2 + ["250"] * 2,
    ["case belief"] * 3 + ["loop belief"] * 3,
    ["loop path"] * 3 + ["loop rate"] * 3,
]


def draw_figure(grid: Grid, case: Case, complete: Complete) -> Figure:
    """All panels, as `CAPTION` tells them."""
    figure = Figure(figsize=(9.2, 15.5), layout="constrained")
    panels: dict[str, Any] = figure.subplot_mosaic(_PANELS)
    responses = case.free[_AT_HZ]
    _draw_paths(panels["path"], responses)
    _draw_distance(panels["time"], responses)
    over_dead_time = [Cell(_AT_HZ, dead_time, _AT_LAG_MS) for dead_time in DEAD_TIMES_MS]
    _draw_cut(panels["dead time"], grid, over_dead_time, DEAD_TIMES_MS, "dead time")
    over_lag = [Cell(_AT_HZ, _AT_DEAD_TIME_MS, lag) for lag in LAGS_MS]
    _draw_cut(panels["lag"], grid, over_lag, LAGS_MS, "lag")
    for rate in RATES_HZ:
        _draw_ratios(panels[f"{rate:.0f}"], grid, rate)
    _draw_beliefs(panels["case belief"], case.wrong)
    panels["case belief"].set_title(f"Wrong knowledge, the case in full, {WRONG_AT_HZ:.0f} Hz")
    _draw_inner_loop_beliefs(panels["loop belief"], complete)
    told = complete[TOLD_AT_HZ]
    _draw_paths(panels["loop path"], told.right)
    panels["loop path"].set_title(f"Path, complete inner loop, {TOLD_AT_HZ:.0f} Hz")
    _draw_rates(panels["loop rate"], complete)
    return figure


def _draw_paths(axes: Axes, responses: dict[Method, Response]) -> None:
    draw_plane(axes, [(m, m.label, r.at(0)) for m, r in responses.items()], _ENDS)


def _draw_distance(axes: Axes, responses: dict[Method, Response]) -> None:
    for method, response in responses.items():
        away = response.at(0)[:, 1] - FIGURE_2.target.east
        draw(axes, response.step.time, away, method.line, method.label)
    axes.set(title="Distance from the line", xlabel="time, s", ylabel="$a_E$ + 0.5", xlim=(0, 1.5))
    axes.legend(ncols=2)


def _draw_cut(
    axes: Axes, grid: Grid, cells: list[Cell], values_ms: tuple[int, ...], words: str
) -> None:
    """Cross-track along one line of the grid."""
    for method in METHODS:
        across = [grid[cell].right[method].cross_track for cell in cells]
        axes.plot(values_ms, across, marker=".", **method.line)
    right = [grid[cell].right[FOLLOWING].cross_track for cell in cells]
    worst = [grid[cell].worst for cell in cells]
    axes.fill_between(values_ms, right, worst, **_SHADE, label="model-following, times wrong")
    axes.set(
        title=f"Cross-track by {words}, {_AT_HZ:.0f} Hz",
        xlabel=f"{words}, ms",
        ylabel=_ACROSS,
        yscale="log",
    )
    axes.legend(loc="center right")


def _draw_ratios(axes: Axes, grid: Grid, rate_hz: float) -> None:
    """Worst belief against the best other method, over dead time and lag."""
    ratios = np.array(
        [[grid[Cell(rate_hz, d, lag)].ratio for d in DEAD_TIMES_MS] for lag in LAGS_MS]
    )
    shades = colormaps["Purples"].with_extremes(over=_WORSE)
    axes.imshow(ratios, cmap=shades, vmin=0.0, vmax=1.0, origin="lower", aspect="auto")
    for (row, column), ratio in np.ndenumerate(ratios):
        colour = "white" if ratio > 0.6 else "black"
        axes.text(column, row, f"{ratio:.2f}", ha="center", va="center", color=colour)
    axes.grid(visible=False)
    axes.set(
        title=f"Worst / best other, {rate_hz:.0f} Hz",
        xlabel="dead time, ms",
        ylabel="lag, ms",
        xticks=range(len(DEAD_TIMES_MS)),
        xticklabels=[str(value) for value in DEAD_TIMES_MS],
        yticks=range(len(LAGS_MS)),
        yticklabels=[str(value) for value in LAGS_MS],
    )


def _draw_beliefs(axes: Axes, cross_tracks: dict[Belief, float]) -> None:
    """Cross-track over the error of the dead time, a line for each error of the lag."""
    errors = [100.0 * error for error in FINER]
    for lag, look in _BY_LAG.items():
        across = [cross_tracks[Belief(lag, dead_time)] for dead_time in FINER]
        line = {"color": FOLLOWING.colour, "linewidth": 1.3, **look}
        axes.plot(errors, across, label=f"lag {in_percent(lag)}", **line)
    axes.set(xlabel="error of the believed dead time, %", ylabel=_ACROSS, ylim=(0.0, None))
    axes.legend(ncols=2)


def _draw_inner_loop_beliefs(axes: Axes, complete: Complete) -> None:
    told = complete[TOLD_AT_HZ]
    _draw_beliefs(axes, told.believed)
    other = told.best_other
    across = told.score(other).cross_track
    axes.axhline(across, **LIMIT)
    axes.annotate(f"{other.label}, the best of the others", (50, across), ha="right", va="bottom")
    axes.set(
        title=f"Wrong knowledge, complete inner loop, {TOLD_AT_HZ:.0f} Hz",
        ylim=(0.0, 1.1 * max(across, *told.believed.values())),
    )


def _draw_rates(axes: Axes, complete: Complete) -> None:
    rates = list(complete)
    for method in METHODS:
        across = [at.score(method).cross_track for at in complete.values()]
        axes.plot(rates, across, marker=".", **method.line)
    right = [at.believed[RIGHT] for at in complete.values()]
    worst = [at.believed[at.worst_belief] for at in complete.values()]
    axes.fill_between(rates, right, worst, **_SHADE, label="model-following, times wrong")
    axes.set(
        title="Cross-track by sample rate, complete inner loop",
        xlabel="sample rate, Hz",
        ylabel=_ACROSS,
        xscale="log",
        xticks=rates,
        xticklabels=[f"{rate:.0f}" for rate in rates],
        ylim=(0.0, None),
    )
    axes.minorticks_off()
    axes.legend(loc="center right", bbox_to_anchor=(1.0, 0.68))
