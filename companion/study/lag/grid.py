"""All planners over dead time, lag and sample rate, and model-following with wrong times there."""

from itertools import product
from typing import NamedTuple

from companion.study.lag.belief import HALF_OFF, RIGHT, Belief, Times, beliefs, planner_told
from companion.study.lag.flown import METHODS, OTHERS, RATES_HZ, SCORE_COLUMNS, Score, score_of
from companion.study.lag.loop import LagLoop
from companion.study.methods import FOLLOWING, Method
from companion.study.outcome import Tick
from companion.study.table import Cell as TableCell
from companion.study.table import Table

DEAD_TIMES_MS = (0, 20, 40, 60, 80)
LAGS_MS = (10, 25, 40, 60)
PARTS = len(DEAD_TIMES_MS) * len(LAGS_MS)


class Cell(NamedTuple):
    """One place of the grid."""

    rate_hz: float
    dead_time_ms: int
    lag_ms: int

    def __str__(self) -> str:
        return f"dead time {self.dead_time_ms} ms, lag {self.lag_ms} ms, {self.rate_hz:.0f} Hz"


class Place(NamedTuple):
    """What was flown at one place of the grid.

    Attributes:
        right: every method, model-following with the right times.
        wrong: model-following with every wrong belief. A dead time of 0 has none.
    """

    right: dict[Method, Score]
    wrong: dict[Belief, Score]

    @property
    def best_other(self) -> Method:
        """The straightest of the methods that know nothing of the rate loop."""
        return min(OTHERS, key=lambda method: self.right[method].cross_track)

    @property
    def worst_belief(self) -> Belief:
        """The wrong belief that bends the line most."""
        return max(self.wrong, key=lambda belief: self.wrong[belief].cross_track)

    @property
    def worst(self) -> float:
        """Cross-track of model-following with that belief."""
        return self.wrong[self.worst_belief].cross_track

    @property
    def ratio(self) -> float:
        """Of the worst belief's cross-track to that of the best other method; below 1 is better."""
        return self.worst / self.right[self.best_other].cross_track


Grid = dict[Cell, Place]


def times_of(loop: LagLoop) -> Times:
    """The true times of a loop that is the same on every axis."""
    lag, dead_time = 1e-3 * loop.lag_ms, 1e-3 * loop.dead_time_ms
    return Times(lag, dead_time, lag, dead_time)


def fly_grid(tick: Tick) -> Grid:
    """Fly every cell: each method, and model-following with times half or one and a half long."""
    grid = {}
    for dead_time, lag in product(DEAD_TIMES_MS, LAGS_MS):
        tick(f"dead time {dead_time} ms, lag {lag} ms")
        loop = LagLoop(lag, dead_time)
        for rate in RATES_HZ:
            grid[Cell(rate, dead_time, lag)] = _fly(loop, rate)
    return grid


def _fly(loop: LagLoop, rate_hz: float) -> Place:
    times = times_of(loop)
    wrong = {
        belief: score_of(planner_told(FOLLOWING, times.believed(belief)), loop, rate_hz)
        for belief in beliefs(HALF_OFF)
        if belief != RIGHT and (loop.dead_time_ms or not belief.dead_time)
    }
    right = {m: score_of(planner_told(m, times), loop, rate_hz) for m in METHODS}
    return Place(right, wrong)


def worst_table(grid: Grid) -> Table:
    """The worst belief beside the best other method, a row for each rate and lag."""
    rows: list[tuple[TableCell, ...]] = []
    for rate, lag in product(RATES_HZ, LAGS_MS):
        places = [grid[Cell(rate, dead_time, lag)] for dead_time in DEAD_TIMES_MS]
        others = [place.right[place.best_other].cross_track for place in places]
        rows.append((f"{rate:.0f} Hz, {lag} ms", *(place.worst for place in places), *others))
    return Table(
        "lag-worst-knowledge",
        "Cross-track over the grid, by rate and lag (rows) and dead time (columns): model-following"
        " with lag and dead time wrongly known by ±50 %, the worst of all combinations, and the"
        " best of the other methods, which need to know neither.",
        (
            "rate, lag",
            *(f"worst, {dead_time} ms" for dead_time in DEAD_TIMES_MS),
            *(f"best other, {dead_time} ms" for dead_time in DEAD_TIMES_MS),
        ),
        tuple(rows),
    )


def series(grid: Grid) -> tuple[Table, Table]:
    """Every flight: with the right times, and with the wrong ones."""
    place = ("dead time, ms", "lag, ms", "rate, Hz")
    return (
        Table(
            "lag-grid",
            "All methods over the grid, model-following with the right times.",
            ("method", *place, *SCORE_COLUMNS),
            tuple(
                (method.label, cell.dead_time_ms, cell.lag_ms, cell.rate_hz, *flown)
                for cell, at in grid.items()
                for method, flown in at.right.items()
            ),
        ),
        Table(
            "lag-grid-wrong-knowledge",
            "model-following over the grid, with wrong times.",
            (*place, "error of the lag", "error of the dead time", *SCORE_COLUMNS),
            tuple(
                (cell.dead_time_ms, cell.lag_ms, cell.rate_hz, *belief, *flown)
                for cell, at in grid.items()
                for belief, flown in at.wrong.items()
            ),
        ),
    )
