"""Past the paper: every planner behind a rate loop with dead time and lag."""

from dataclasses import replace
from math import pi
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from companion.attitude import Limits, Planner, make_planner
from companion.study.drawing import draw, draw_plane, new_figure
from companion.study.fit import FIT_COLUMNS, SecondOrderFit, fit_second_order, second_order_path
from companion.study.inner_loop import InnerLoop
from companion.study.lag_loop import LagLoop
from companion.study.measures import cross_track, largest_deviation, largest_tilt_rate, time_to
from companion.study.methods import EXACT, FOLLOWING, PAPERS, PROPOSED, QUATERNION, Method
from companion.study.outcome import Finding, Outcome, Tick
from companion.study.step import FIGURE_2, Response, fly_loop
from companion.study.table import Cell, Table

DEAD_TIMES_MS = (0, 20, 40, 60, 80)
LAGS_MS = (10, 25, 40, 60)
RATES_HZ = (50.0, 100.0, 250.0)
METHODS = (*PAPERS, EXACT, FOLLOWING)
CASE = LagLoop(lag_ms=25, dead_time_ms=45)
"""The case that is told in full: between what PX4 and ArduPilot were measured to have."""
ERRORS = (-0.5, -0.3, 0.0, 0.3, 0.5)
"""By which the planner knows lag and dead time wrongly."""

_HEADING = replace(FIGURE_2, headings=(0.0,))
_MAX_TILT_RATE = pi / 2.0
_COMPLETE = InnerLoop(transport_delay=0.02)
_COMPLETE_STEP = replace(_HEADING, rate_hz=250.0)
_COMPLETE_RESPONSE = {
    "lag": 0.047,
    "dead_time": 0.040 + _COMPLETE.transport_delay,
    "yaw_lag": 0.37,
    "yaw_dead_time": 0.102 + _COMPLETE.transport_delay,
}
"""First order and dead time as fitted to the measured PX4, and the transport delay, s."""

PARTS = len(DEAD_TIMES_MS) * len(LAGS_MS) + 4


class _Complete(NamedTuple):
    """One planner with the complete inner loop, and the second-order model it comes nearest to."""

    response: Response
    fit: SecondOrderFit
    from_fit: float  # largest deviation from that model


class _Row(NamedTuple):
    """One flown cell of the grid."""

    method: Method
    loop: LagLoop
    rate_hz: float
    cross_track: float


def run(tick: Tick) -> Outcome:
    """Fly the step of figure 2 over dead times, lags and rates, and with wrong knowledge."""
    grid = _grid(tick)
    tick("the case in full")
    case = {rate: _case(rate) for rate in (100.0, 250.0)}
    tick("wrong knowledge")
    wrong = _wrong_knowledge(100.0)
    tick("rate limit")
    limited = {rate: _limited(rate) for rate in (100.0, 250.0)}
    tick("complete inner loop")
    complete = {method: _fly_complete(method) for method in METHODS}
    return Outcome(
        name="lag",
        title="Lag: behind a rate loop with dead time and lag",
        conditions=(
            "The step of figure 2, p = 5 s⁻¹, through a rate loop with a dead time of 0 to 80 ms"
            " and a first-order lag of 10 to 60 ms, planners at 50 to 250 Hz. The case in full has"
            f" {CASE.dead_time_ms} and {CASE.lag_ms} ms. model-following knows both times, rightly"
            " or with the errors given. Below, the complete inner loop of figure 5 with 20 ms of"
            " transport delay, at 250 Hz, of which it knows the first-order fit."
        ),
        figure=_figure(grid, case[100.0], wrong, complete),
        caption=(
            "Paths and distance from the line in the case in full, at 100 Hz; cross-track over the"
            " dead time (lag 25 ms) and over the lag (dead time 40 ms); cross-track of"
            " model-following with wrong knowledge; paths with the complete inner loop."
        ),
        tables=(
            _case_table(case, limited),
            _wrong_table(wrong),
            _complete_table(complete),
        ),
        findings=_findings(case, wrong, limited, complete),
        series=(
            Table(
                "lag-grid",
                "Cross-track over the grid.",
                ("method", "dead time, ms", "lag, ms", "rate, Hz", "cross-track"),
                tuple(
                    (
                        row.method.label,
                        row.loop.dead_time_ms,
                        row.loop.lag_ms,
                        row.rate_hz,
                        row.cross_track,
                    )
                    for row in grid
                ),
            ),
        ),
    )


def _planner(method: Method, lag_ms: float, dead_time_ms: float, limits: Limits) -> Planner:
    """A planner; model-following believes the rate loop to have this lag and dead time."""
    known = {"lag": 1e-3 * lag_ms, "dead_time": 1e-3 * dead_time_ms}
    options = known if method is FOLLOWING else {}
    return make_planner(method.planner, FIGURE_2.gain, limits=limits, **options)


def _grid(tick: Tick) -> list[_Row]:
    rows = []
    for dead_time in DEAD_TIMES_MS:
        for lag in LAGS_MS:
            tick(f"dead time {dead_time} ms, lag {lag} ms")
            loop = LagLoop(lag, dead_time)
            for rate in RATES_HZ:
                step = replace(_HEADING, rate_hz=rate)
                for method in METHODS:
                    response = fly_loop(_planner(method, lag, dead_time, Limits()), step, loop)
                    rows.append(_Row(method, loop, rate, float(cross_track(response)[0])))
    return rows


def _case(rate_hz: float) -> dict[Method, Response]:
    step = replace(_HEADING, rate_hz=rate_hz)
    return {
        m: fly_loop(_planner(m, CASE.lag_ms, CASE.dead_time_ms, Limits()), step, CASE)
        for m in METHODS
    }


def _limited(rate_hz: float) -> Response:
    step = replace(_HEADING, rate_hz=rate_hz)
    limits = Limits(max_tilt_rate=_MAX_TILT_RATE)
    return fly_loop(_planner(FOLLOWING, CASE.lag_ms, CASE.dead_time_ms, limits), step, CASE)


def _wrong_knowledge(rate_hz: float) -> dict[tuple[float, float], float]:
    """Cross-track of model-following by the errors of lag and dead time."""
    step = replace(_HEADING, rate_hz=rate_hz)
    out = {}
    for lag_error in ERRORS:
        for dead_error in ERRORS:
            planner = _planner(
                FOLLOWING,
                CASE.lag_ms * (1.0 + lag_error),
                CASE.dead_time_ms * (1.0 + dead_error),
                Limits(),
            )
            out[lag_error, dead_error] = float(cross_track(fly_loop(planner, step, CASE))[0])
    return out


def _fly_complete(method: Method) -> _Complete:
    options = _COMPLETE_RESPONSE if method is FOLLOWING else {}
    planner = make_planner(method.planner, FIGURE_2.gain, limits=Limits(), **options)
    response = fly_loop(planner, _COMPLETE_STEP, _COMPLETE)
    fit = fit_second_order(_COMPLETE_STEP, response.at(0))
    model = second_order_path(_COMPLETE_STEP, fit, _COMPLETE_STEP.time)
    return _Complete(response, fit, float(largest_deviation(response, model)[0]))


def _case_table(case: dict[float, dict[Method, Response]], limited: dict[float, Response]) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for rate, responses in case.items():
        flown = [(method.label, response) for method, response in responses.items()]
        flown.append(("model-following, W_M = π/2", limited[rate]))
        rows += [
            (
                label,
                round(rate),
                float(cross_track(response)[0]),
                float(time_to(response)[0]),
                largest_tilt_rate(response),
            )
            for label, response in flown
        ]
    return Table(
        "lag",
        f"The case in full: dead time {CASE.dead_time_ms} ms, lag {CASE.lag_ms} ms.",
        ("method", "rate, Hz", "cross-track", "time to 5 %, s", "largest √(ω_x²+ω_y²), rad/s"),
        tuple(rows),
    )


def _wrong_table(wrong: dict[tuple[float, float], float]) -> Table:
    return Table(
        "lag-wrong-knowledge",
        "Cross-track of model-following at 100 Hz in the same case, by what it believes of the lag"
        " (rows) and of the dead time (columns), against the truth.",
        ("lag", *(f"dead time {_percent(error)}" for error in ERRORS)),
        tuple((_percent(lag), *(wrong[lag, dead_time] for dead_time in ERRORS)) for lag in ERRORS),
    )


def _percent(error: float) -> str:
    return f"{100.0 * error:+.0f} %" if error else "right"


def _complete_table(complete: dict[Method, _Complete]) -> Table:
    return Table(
        "lag-inner-loop",
        "The complete inner loop with 20 ms of transport delay, 250 Hz, heading 0, and the"
        " second-order model with dead time that each response comes nearest to.",
        (
            "method",
            "cross-track",
            "time to 5 %, s",
            *FIT_COLUMNS,
            "largest deviation from it",
        ),
        tuple(
            (
                method.label,
                float(cross_track(flown.response)[0]),
                float(time_to(flown.response)[0]),
                *flown.fit.cells,
                flown.from_fit,
            )
            for method, flown in complete.items()
        ),
    )


def _figure(
    grid: list[_Row],
    case: dict[Method, Response],
    wrong: dict[tuple[float, float], float],
    complete: dict[Method, _Complete],
) -> Figure:
    figure, ((plane, time), (over_dead, over_lag), (over_error, path)) = new_figure(
        3, 2, height=3.1
    )
    ends = np.array([FIGURE_2.start, FIGURE_2.target])
    draw_plane(plane, [(m, m.label, r.at(0)) for m, r in case.items()], ends)
    for method, response in case.items():
        away = response.at(0)[:, 1] - FIGURE_2.target.east
        draw(time, response.step.time, away, method.line, method.label)
    time.set(title="Distance from the line", xlabel="time, s", ylabel="$a_E$ + 0.5", xlim=(0, 1.5))
    time.legend(ncols=2)
    for axes, key, other, words in (
        (over_dead, "dead_time_ms", ("lag_ms", 25), "dead time"),
        (over_lag, "lag_ms", ("dead_time_ms", 40), "lag"),
    ):
        for method in METHODS:
            rows = [
                row
                for row in grid
                if row.method is method
                and row.rate_hz == 100.0
                and getattr(row.loop, other[0]) == other[1]
            ]
            x = [getattr(row.loop, key) for row in rows]
            axes.plot(x, [row.cross_track for row in rows], marker=".", **method.line)
        axes.set(
            title=f"Cross-track by {words}, 100 Hz",
            xlabel=f"{words}, ms",
            ylabel="largest distance from the line",
            yscale="log",
        )
    for lag_error, dashes in zip(ERRORS, ((1, 1), (3, 1), (), (5, 2), (8, 2)), strict=True):
        style = {**FOLLOWING.line, "linestyle": (0, dashes) if dashes else "-", "linewidth": 1.4}
        values = [wrong[lag_error, error] for error in ERRORS]
        x = [100.0 * error for error in ERRORS]
        over_error.plot(x, values, marker=".", label=f"lag {_percent(lag_error)}", **style)
    over_error.set(
        title="model-following with wrong knowledge",
        xlabel="error of the believed dead time, %",
        ylabel="largest distance from the line",
        ylim=(0.0, None),
    )
    over_error.legend(ncols=2)
    draw_plane(path, [(m, m.label, flown.response.at(0)) for m, flown in complete.items()], ends)
    path.set_title(f"{path.get_title()}, complete inner loop")
    return figure


def _findings(
    case: dict[float, dict[Method, Response]],
    wrong: dict[tuple[float, float], float],
    limited: dict[float, Response],
    complete: dict[Method, _Complete],
) -> tuple[Finding, ...]:
    across = {m: float(cross_track(r)[0]) for m, r in case[100.0].items()}
    others = [method for method in METHODS if method is not FOLLOWING]
    best = min(others, key=lambda method: across[method])
    rate = max(largest_tilt_rate(response) for response in limited.values())
    bent = {m: float(cross_track(flown.response)[0]) for m, flown in complete.items()}
    apart = {m: flown.from_fit for m, flown in complete.items()}
    nearest = min(others, key=lambda method: apart[method])
    return (
        Finding(
            "asked",
            "Behind dead time and lag the proposed method keeps closest to the straight line.",
            across[PROPOSED] <= across[best],
            f"Cross-track at 100 Hz: first-order {across[PROPOSED]:.2g}, {best.label}"
            f" {across[best]:.2g}.",
        ),
        Finding(
            "asked",
            "model-following is the straightest there, and still is with lag and dead time wrongly"
            " known by up to 50 %.",
            max(wrong.values()) < across[best],
            f"Cross-track {across[FOLLOWING]:.2g} with the right times, at most"
            f" {max(wrong.values()):.2g} with wrong ones; the best of the others has"
            f" {across[best]:.2g}.",
        ),
        Finding(
            "asked",
            "It keeps the limit of the tilt rate.",
            rate <= _MAX_TILT_RATE * (1.0 + 1e-9),
            f"With W_M = {_MAX_TILT_RATE:.3f} rad/s it commands at most {rate:.3f} rad/s,"
            f" cross-track {max(float(cross_track(r)[0]) for r in limited.values()):.2g}.",
        ),
        Finding(
            "asked",
            "With the complete inner loop and transport delay it is the straightest.",
            bent[FOLLOWING] < min(bent[method] for method in others),
            f"Cross-track {bent[FOLLOWING]:.2g}; first-order {bent[PROPOSED]:.2g}, quaternion"
            f" {bent[QUATERNION]:.2g}.",
        ),
        Finding(
            "asked",
            "And nearest to second order with dead time.",
            apart[FOLLOWING] < apart[nearest],
            f"Within {apart[FOLLOWING]:.2g} of its nearest such model; {nearest.label}, the next,"
            f" within {apart[nearest]:.2g}.",
        ),
    )
