"""The study put together: what is flown, and the page's section made of it."""

from companion.study.lag import case, complete, grid
from companion.study.lag.figure import CAPTION, draw_figure
from companion.study.lag.findings import find
from companion.study.outcome import Outcome, Tick

PARTS = grid.PARTS + 1 + complete.PARTS


def run(tick: Tick) -> Outcome:
    """Fly the step of figure 2 over dead times, lags and rates, with right and wrong knowledge."""
    over_grid = grid.fly_grid(tick)
    tick("the case in full")
    in_full = case.fly_case()
    inner_loop = complete.fly_complete(tick)
    fitted = complete.fit_all(inner_loop)
    return Outcome(
        name="lag",
        title="Lag: behind a rate loop with dead time and lag",
        conditions=(
            "The step of figure 2, p = 5 s⁻¹, through a rate loop with a dead time of 0 to 80 ms"
            " and a first-order lag of 10 to 60 ms, planners at 50 to 250 Hz. The case in full has"
            f" {case.LOOP.dead_time_ms} and {case.LOOP.lag_ms} ms. model-following knows both"
            " times, rightly or with the errors given. Below, the complete inner loop of figure 5"
            " with 20 ms of transport delay, of which it knows the first-order fit."
        ),
        figure=draw_figure(over_grid, in_full, inner_loop),
        caption=CAPTION,
        tables=(
            case.case_table(in_full),
            case.wrong_table(in_full),
            grid.worst_table(over_grid),
            complete.fit_table(fitted),
            complete.rates_table(inner_loop),
            complete.wrong_table(inner_loop),
        ),
        findings=find(over_grid, in_full, inner_loop, fitted),
        series=(*grid.series(over_grid), complete.series(inner_loop)),
    )
