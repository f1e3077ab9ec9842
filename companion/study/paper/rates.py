"""Discretisation error of the planner `first-order` by sample rate; `exact` has none."""

from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure

from companion.study.drawing import draw_line, new_figure
from companion.study.measures import cross_track, deviation, largest_deviation
from companion.study.methods import EXACT, PROPOSED, Method, planner_of
from companion.study.outcome import Finding, Outcome, Table, Tick
from companion.study.step import FIGURE_2, Floats, Response, Step, fly

RATES_HZ = (1000.0, 500.0, 250.0, 100.0, 50.0)
_ROUNDING = 1e-12
PROGRESS_STEPS = 2 * len(RATES_HZ)


def run(tick: Tick) -> Outcome:
    """Fly the step of figure 2 at several sample rates with `first-order` and with `exact`."""
    steps = {hz: replace(FIGURE_2, rate_hz=hz, headings=(0.0, 1.0, 2.5)) for hz in RATES_HZ}
    responses: dict[tuple[Method, float], Response] = {}
    for hz, step in steps.items():
        for method in (PROPOSED, EXACT):
            tick(f"{method.label} at {hz:.0f} Hz")
            responses[method, hz] = fly(planner_of(method, step.gain), step)
    largest_deviations = {
        key: float(largest_deviation(response, steps[key[1]].reference()).max())
        for key, response in responses.items()
    }
    rows = tuple(
        {
            "rate, Hz": round(hz),
            "proposed: deviation": largest_deviations[PROPOSED, hz],
            "proposed: cross-track": float(cross_track(responses[PROPOSED, hz]).max()),
            "exact: deviation": largest_deviations[EXACT, hz],
            "exact: cross-track": float(cross_track(responses[EXACT, hz]).max()),
        }
        for hz in RATES_HZ
    )
    return Outcome(
        name="rates",
        title="Sample rates: the discretisation error, and the exact planner, which has none",
        conditions="The step of figure 2 at 1000, 500, 250, 100 and 50 Hz, three headings.",
        figure=_figure(responses, largest_deviations, steps),
        caption=(
            "Largest deviation by sample rate; the deviation over time at 50 Hz; the path of the"
            " proposed method at each rate, a_E enlarged."
        ),
        tables=(
            Table(
                "rates",
                "The proposed planner beside its exact form in discrete time.",
                rows,
            ),
        ),
        findings=(_finding(largest_deviations),),
    )


def _finding(largest_deviations: dict[tuple[Method, float], float]) -> Finding:
    lowest_hz, highest_hz = min(RATES_HZ), max(RATES_HZ)
    largest = max(largest_deviations[EXACT, hz] for hz in RATES_HZ)
    return Finding(
        "paper",
        "The deviation of the proposed method comes from discretisation.",
        largest_deviations[PROPOSED, lowest_hz] > 10.0 * largest_deviations[PROPOSED, highest_hz]
        and largest <= _ROUNDING,
        f"It grows from {largest_deviations[PROPOSED, highest_hz]:.2g} at"
        f" {highest_hz:.0f} Hz to"
        f" {largest_deviations[PROPOSED, lowest_hz]:.2g} at {lowest_hz:.0f} Hz. With"
        " exact, which"
        f" solves each sample in closed form, it is at most {largest:.1g} at every rate.",
    )


def _figure(
    responses: dict[tuple[Method, float], Response],
    largest_deviations: dict[tuple[Method, float], float],
    steps: dict[float, Step],
) -> Figure:
    figure, ((rate_panel, time_panel, plane),) = new_figure(1, 3, width=4.0)
    for method, marker in ((PROPOSED, "o"), (EXACT, "s")):
        values = [largest_deviations[method, hz] for hz in RATES_HZ]
        rate_panel.plot(RATES_HZ, values, marker=marker, label=method.label, **method.line_style)
    rate_panel.set(
        title="Largest deviation",
        xlabel="sample rate, Hz",
        ylabel="max |c − reference|",
        xscale="log",
        yscale="log",
        xticks=RATES_HZ,
        xticklabels=[f"{hz:.0f}" for hz in RATES_HZ],
    )
    rate_panel.minorticks_off()
    rate_panel.legend(loc="center right")
    lowest_hz = min(RATES_HZ)
    for method in (PROPOSED, EXACT):
        error = deviation(responses[method, lowest_hz], steps[lowest_hz].reference())[:, 0]
        draw_line(time_panel, steps[lowest_hz].time[1:], error[1:], method.line_style, method.label)
    time_panel.set(
        title=f"Deviation at {lowest_hz:.0f} Hz",
        xlabel="time, s",
        ylabel="|c − reference|",
        yscale="log",
    )
    shades = np.linspace(1.0, 0.35, len(RATES_HZ))
    for hz, alpha in zip(reversed(RATES_HZ), shades, strict=True):
        c = responses[PROPOSED, hz].at_heading(0)
        line_style = {**PROPOSED.line_style, "alpha": alpha}
        draw_line(plane, _distance_from_line(c), c[:, 0], line_style, f"proposed, {hz:.0f} Hz")
    exact = responses[EXACT, lowest_hz].at_heading(0)
    draw_line(
        plane,
        _distance_from_line(exact),
        exact[:, 0],
        EXACT.line_style,
        f"exact, {lowest_hz:.0f} Hz",
    )
    plane.set(title="Paths, axis of $a_E$ enlarged", xlabel="($a_E$ + 0.5) × 1000", ylabel="$a_N$")
    plane.set_xlim(right=5.2)
    plane.legend(loc="center right")
    return figure


def _distance_from_line(c: Floats) -> Floats:
    """(n,) distance of (n, 2) coefficients from the straight line of the step, in thousandths."""
    return np.asarray(1e3 * (c[:, 1] - FIGURE_2.target.east))
