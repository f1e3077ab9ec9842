"""Figure 5: the step of figure 2 with the complete inner loop."""

from dataclasses import replace
from math import hypot, pi
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from companion.study.drawing import draw, draw_plane, draw_reference, draw_response, new_figure
from companion.study.fit import FIT_COLUMNS, SecondOrderFit, fit_second_order, second_order_path
from companion.study.inner_loop import quickened
from companion.study.measures import (
    cross_track,
    deviation,
    heading_effect,
    largest_deviation,
    time_to,
)
from companion.study.methods import (
    EXACT,
    PAPERS,
    PROPOSED,
    QUATERNION,
    REFERENCE,
    SO3,
    Method,
    planner_of,
)
from companion.study.outcome import Finding, Outcome, Tick
from companion.study.step import FIGURE_2, Response, fly_loop
from companion.study.table import Cell, Table

STEP = replace(FIGURE_2, headings=tuple(k * pi / 4.0 for k in range(-3, 5)))
_ONE_HEADING = replace(FIGURE_2, headings=(0.0,))
_METHODS = (*PAPERS, EXACT)
_QUICK, _MEASURED = 5, 1
"""How many times as quick as the bundled vehicle; that one answers as a PX4 was measured to."""
_SWEEP = (10, 5, 3, 2, 1)
PARTS = 2 * len(_METHODS) + len(_SWEEP)

_SECOND_ORDER_SHARE = 0.02
_STEP_LENGTH = hypot(*np.subtract(STEP.target, STEP.start))
_SECOND_ORDER = {**REFERENCE, "color": "#666666", "linestyle": (0, (4, 1.5, 1, 1.5))}


class _Loop(NamedTuple):
    """Every method flown with one inner loop."""

    time_63: float  # s, in which a step of the roll rate reaches 63 %
    responses: dict[Method, Response]
    fits: dict[Method, SecondOrderFit]


def run(tick: Tick) -> Outcome:
    """Fly the step of figure 2 with every method through rate loop, rotors and rigid body."""
    quick, measured = _fly(_QUICK, tick), _fly(_MEASURED, tick)
    sweep = _sweep(tick)
    return Outcome(
        name="fig5",
        title="Figure 5: step response with the complete inner loop",
        conditions=(
            "The step of figure 2 through a PI rate loop with feed-forward and saturation, rotor"
            " lag, aerodynamic damping and a rigid body with gyroscopic torque; 8 headings. How"
            " quick that loop is decides the outcome, so it is flown twice: with the bundled"
            " vehicle, which answers as a PX4 was measured to (a step of the roll rate reaches"
            f" 63 % after {1e3 * measured.time_63:.0f} ms), and with one whose every time is"
            f" {_QUICK} times shorter ({1e3 * quick.time_63:.0f} ms)."
        ),
        figure=_figure(quick, measured, sweep),
        caption=(
            "Every method at the heading where it leaves the line most; above with the quick inner"
            " loop, below with the measured one, whose rotors saturate at the start and leave a"
            " slow tail. The second-order reference, with a dead time, is the one that first-order"
            " comes nearest to. Below right: cross-track over the quickness of the loop."
        ),
        tables=(
            Table(
                "fig5",
                "Step response with the complete inner loop; largest values over 8 headings. The"
                " second-order model is fitted at the heading of the largest cross-track.",
                (
                    "method",
                    "63 % of a rate step, ms",
                    "largest deviation from first order",
                    "cross-track",
                    "time to 5 %, s",
                    *FIT_COLUMNS,
                    "largest deviation from it",
                    "difference between headings",
                ),
                tuple(_row(method, loop) for loop in (quick, measured) for method in _METHODS),
            ),
            Table(
                "fig5-quickness",
                "Cross-track over the quickness of the inner loop, heading 0.",
                ("63 % of a rate step, ms", *(method.label for method in PAPERS)),
                tuple(
                    (1e3 * time_63, *(across[method] for method in PAPERS))
                    for time_63, across in sweep.items()
                ),
            ),
        ),
        findings=_findings(quick, measured, sweep),
    )


def _fly(factor: int, tick: Tick) -> _Loop:
    inner_loop = quickened(factor)
    time_63 = inner_loop.rate_step_63()
    responses, fits = {}, {}
    for method in _METHODS:
        tick(f"{method.label}, {1e3 * time_63:.0f} ms")
        responses[method] = fly_loop(planner_of(method, STEP.gain), STEP, inner_loop)
        fits[method] = fit_second_order(STEP, responses[method].at(_worst(responses[method])))
    return _Loop(time_63, responses, fits)


def _sweep(tick: Tick) -> dict[float, dict[Method, float]]:
    """Cross-track of every method by the 63 % time (s) of the inner loop."""
    out = {}
    for factor in _SWEEP:
        inner_loop = quickened(factor)
        time_63 = inner_loop.rate_step_63()
        tick(f"cross-track, {1e3 * time_63:.0f} ms")
        out[time_63] = {
            method: float(
                cross_track(fly_loop(planner_of(method, STEP.gain), _ONE_HEADING, inner_loop))[0]
            )
            for method in PAPERS
        }
    return out


def _worst(response: Response) -> int:
    """Index of the heading at which a response leaves the straight line most."""
    return int(cross_track(response).argmax())


def _from_second_order(method: Method, loop: _Loop) -> float:
    """Largest deviation from the fitted model, at the heading of the fit."""
    response = loop.responses[method]
    model = second_order_path(STEP, loop.fits[method], STEP.time)
    return float(largest_deviation(response, model)[_worst(response)])


def _row(method: Method, loop: _Loop) -> tuple[Cell, ...]:
    response, fit = loop.responses[method], loop.fits[method]
    return (
        method.label,
        1e3 * loop.time_63,
        float(largest_deviation(response, STEP.reference()).max()),
        float(cross_track(response).max()),
        float(time_to(response).max()),
        *fit.cells,
        _from_second_order(method, loop),
        heading_effect(response),
    )


def _figure(quick: _Loop, measured: _Loop, sweep: dict[float, dict[Method, float]]) -> Figure:
    figure, axes = new_figure(4, 2, height=2.9)
    _draw_loop((axes[0, 0], axes[0, 1], axes[1, 0]), quick)
    _draw_loop((axes[2, 0], axes[2, 1], axes[3, 0]), measured)
    away, across = axes[1, 1], axes[3, 1]
    for method in PAPERS:
        response = quick.responses[method]
        error = deviation(response, STEP.reference())[:, _worst(response)]
        draw(away, STEP.time, error, method.line)
        times = 1e3 * np.array(list(sweep))
        values = [tracks[method] for tracks in sweep.values()]
        across.plot(times, values, marker="o", markersize=4, **method.line)
    away.set(
        title=f"Distance from first order, {_words(quick)}",
        xlabel="time, s",
        ylabel="|c − reference|",
        xlim=(0.0, 1.5),
        ylim=(0.0, None),
    )
    across.set(
        title="Cross-track by quickness, heading 0",
        xlabel="63 % of a rate step, ms",
        ylabel="largest distance from the line",
        ylim=(0.0, None),
        xlim=(0.0, None),
    )
    axes[0, 0].legend(loc="lower right")
    return figure


def _draw_loop(panels: tuple[Axes, Axes, Axes], loop: _Loop) -> None:
    """Response and path of every method with one inner loop, each at its worst heading."""
    north, east, plane = panels
    curves = [
        (method, method.label, loop.responses[method].at(_worst(loop.responses[method])))
        for method in PAPERS
    ]
    second = second_order_path(STEP, loop.fits[PROPOSED], STEP.time)
    draw_response(north, east, STEP.time, curves)
    draw_reference(north, east, STEP.time, STEP.reference())
    draw(north, STEP.time, second[:, 0], _SECOND_ORDER, "second-order reference")
    draw_plane(plane, curves, np.array([STEP.start, STEP.target]))
    for panel in (north, east):
        panel.set(xlim=(0.0, 1.5))
        panel.set_title(f"{panel.get_title()}, {_words(loop)}")
    plane.set_title(f"{plane.get_title()}, {_words(loop)}")


def _words(loop: _Loop) -> str:
    return f"63 % in {1e3 * loop.time_63:.0f} ms"


def _findings(
    quick: _Loop, measured: _Loop, sweep: dict[float, dict[Method, float]]
) -> tuple[Finding, ...]:
    others = [method for method in PAPERS if method is not PROPOSED]
    ahead = [t for t, across in sweep.items() if across[PROPOSED] < min(across[m] for m in others)]
    return (
        *(
            Finding(
                "paper" if loop is quick else "asked",
                f"With a complete inner loop that is {words} ({1e3 * loop.time_63:.0f} ms) the"
                " proposed method still keeps closest to the straight line.",
                _across(loop, PROPOSED) < min(_across(loop, method) for method in others),
                "Cross-track over all headings: "
                + ", ".join(f"{m.label} {_across(loop, m):.2g}" for m in (PROPOSED, *others))
                + ".",
            )
            for words, loop in (("quick", quick), ("as slow as measured", measured))
        ),
        Finding(
            "asked",
            "The proposed method keeps closest to the line whatever the inner loop.",
            len(ahead) == len(sweep),
            "Of the loops flown, at heading 0, it is closest with those of "
            + (", ".join(f"{1e3 * t:.0f}" for t in ahead) or "no")
            + " ms; its cross-track is "
            + ", ".join(f"{across[PROPOSED]:.2g}" for across in sweep.values())
            + " with "
            + ", ".join(f"{1e3 * t:.0f}" for t in sweep)
            + " ms.",
        ),
        Finding(
            "asked",
            "With a complete inner loop heading does not change the response either.",
            max(heading_effect(measured.responses[m]) for m in (PROPOSED, QUATERNION, SO3)) < 1e-3,
            "Largest difference of the paths between any two headings, measured inner loop: "
            + ", ".join(f"{m.label} {heading_effect(measured.responses[m]):.2g}" for m in PAPERS)
            + " (asked: 0.001).",
        ),
        *(
            Finding(
                "paper" if loop is quick else "asked",
                f"With a complete inner loop that is {words} the response of the proposed method"
                " is second order.",
                _from_second_order(PROPOSED, loop) < _SECOND_ORDER_SHARE * _STEP_LENGTH,
                f"After a dead time of {1e3 * loop.fits[PROPOSED].dead_time:.0f} ms it comes within"
                f" {_from_second_order(PROPOSED, loop):.2g} of"
                f" ω = {loop.fits[PROPOSED].model.frequency:.1f} rad/s,"
                f" ζ = {loop.fits[PROPOSED].model.damping:.2f}; asked is 2 % of the step,"
                f" {_SECOND_ORDER_SHARE * _STEP_LENGTH:.2g}.",
            )
            for words, loop in (("quick", quick), ("as slow as measured", measured))
        ),
    )


def _across(loop: _Loop, method: Method) -> float:
    return float(cross_track(loop.responses[method]).max())
