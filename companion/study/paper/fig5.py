"""Figure 5: the step of figure 2 with the complete inner loop."""

from math import hypot

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from companion.study.drawing import draw_line, draw_plane, draw_reference, draw_response, new_figure
from companion.study.measures import (
    deviation,
    fit_cells,
    heading_effect,
    largest_deviation,
    settling_time,
)
from companion.study.methods import (
    EULER,
    LAW_METHODS,
    PAPER_METHODS,
    PROPOSED,
    QUATERNION,
    REFERENCE_STYLE,
    SO3,
)
from companion.study.outcome import Claimant, Finding, Outcome, Table, Tick
from companion.study.paper.fig5_flights import (
    MEASURED_SPEEDUP,
    PROGRESS_STEPS,
    QUICK_SPEEDUP,
    LoopFlights,
    Sweep,
    fly_methods,
    fly_sweep,
)
from companion.study.step import FIGURE_2

__all__ = ["PROGRESS_STEPS", "run"]

_SECOND_ORDER_SHARE = 0.02
"""A response counts as second order if it deviates from the fit by at most this share of the step.
"""
_SECOND_ORDER_LINE = {**REFERENCE_STYLE, "color": "#666666", "linestyle": (0, (4, 1.5, 1, 1.5))}


def run(tick: Tick) -> Outcome:
    """Fly the step of figure 2 with every method through rate loop, rotors and rigid body."""
    quick_loop, measured_loop = (
        fly_methods(QUICK_SPEEDUP, tick),
        fly_methods(MEASURED_SPEEDUP, tick),
    )
    sweep = fly_sweep(tick)
    return Outcome(
        name="fig5",
        title="Figure 5: step response with the complete inner loop",
        conditions=(
            "The step of figure 2 through a PI rate loop with feed-forward and saturation, rotor"
            " lag, aerodynamic damping and a rigid body with gyroscopic torque; 8 headings. The"
            " result depends on the speed of that loop, so two loops are flown: that of the bundled"
            " vehicle, which responds as measured on a PX4 (a step of the roll rate reaches 63 %"
            f" after {1e3 * measured_loop.time_to_63_percent:.0f} ms), and one with all times"
            f" {QUICK_SPEEDUP} times"
            f" shorter ({1e3 * quick_loop.time_to_63_percent:.0f} ms)."
        ),
        figure=_figure(quick_loop, measured_loop, sweep),
        caption=(
            "Every method at the heading with its largest cross-track: above with the quick inner"
            " loop, below with the measured one, whose rotors saturate at the start and cause a"
            " slow tail. The second-order reference, with a dead time, is fitted to first-order."
            " Below right: cross-track by the speed of the loop."
        ),
        tables=(_table(quick_loop, measured_loop), _sweep_table(sweep)),
        findings=_findings(quick_loop, measured_loop, sweep),
    )


def _table(quick_loop: LoopFlights, measured_loop: LoopFlights) -> Table:
    reference = quick_loop.responses[PROPOSED].step.reference()
    return Table(
        "fig5",
        "Step response with the complete inner loop; largest values over 8 headings. The"
        " second-order model is fitted at the heading of the largest cross-track.",
        tuple(
            {
                "method": method.label,
                "63 % of a rate step, ms": 1e3 * loop.time_to_63_percent,
                "largest deviation from first order": float(
                    largest_deviation(loop.responses[method], reference).max()
                ),
                "cross-track": loop.cross_track(method),
                "time to 5 %, s": float(settling_time(loop.responses[method]).max()),
                **fit_cells(loop.fitted_models[method]),
                "largest deviation from this model": loop.deviation_from_second_order(method),
                "difference between headings": heading_effect(loop.responses[method]),
            }
            for loop in (quick_loop, measured_loop)
            for method in LAW_METHODS
        ),
    )


def _sweep_table(sweep: Sweep) -> Table:
    return Table(
        "fig5-quickness",
        "Cross-track by the speed of the inner loop, heading 0.",
        tuple(
            {
                "63 % of a rate step, ms": 1e3 * time_to_63_percent,
                **{method.label: cross_tracks[method] for method in PAPER_METHODS},
            }
            for time_to_63_percent, cross_tracks in sweep.items()
        ),
    )


def _figure(quick_loop: LoopFlights, measured_loop: LoopFlights, sweep: Sweep) -> Figure:
    figure, axes = new_figure(4, 2, height=2.9)
    _draw_loop((axes[0, 0], axes[0, 1], axes[1, 0]), quick_loop)
    _draw_loop((axes[2, 0], axes[2, 1], axes[3, 0]), measured_loop)
    deviation_panel, cross_track_panel = axes[1, 1], axes[3, 1]
    step = quick_loop.responses[PROPOSED].step
    for method in PAPER_METHODS:
        error = deviation(quick_loop.responses[method], step.reference())[
            :, quick_loop.worst_heading(method)
        ]
        draw_line(deviation_panel, step.time, error, method.line_style)
        times = 1e3 * np.array(list(sweep))
        values = [cross_tracks[method] for cross_tracks in sweep.values()]
        cross_track_panel.plot(times, values, marker="o", markersize=4, **method.line_style)
    deviation_panel.set(
        title=f"Distance from first order, {quick_loop}",
        xlabel="time, s",
        ylabel="|c − reference|",
        xlim=(0.0, 1.5),
        ylim=(0.0, None),
    )
    cross_track_panel.set(
        title="Cross-track by quickness, heading 0",
        xlabel="63 % of a rate step, ms",
        ylabel="largest distance from the line",
        ylim=(0.0, None),
        xlim=(0.0, None),
    )
    axes[0, 0].legend(loc="lower right")
    return figure


def _draw_loop(panels: tuple[Axes, Axes, Axes], loop: LoopFlights) -> None:
    """Draw response and path of every method with one inner loop, each at its worst heading."""
    north, east, plane = panels
    curves = [
        (method, method.label, loop.responses[method].at_heading(loop.worst_heading(method)))
        for method in PAPER_METHODS
    ]
    step, second_order_path = loop.responses[PROPOSED].step, loop.fitted_path(PROPOSED)
    draw_response(north, east, step.time, curves)
    draw_reference(north, east, step.time, step.reference())
    draw_line(
        north, step.time, second_order_path[:, 0], _SECOND_ORDER_LINE, "second-order reference"
    )
    draw_plane(plane, curves, step)
    for panel in (north, east):
        panel.set(xlim=(0.0, 1.5))
    for panel in panels:
        panel.set_title(f"{panel.get_title()}, {loop}")


def _findings(
    quick_loop: LoopFlights, measured_loop: LoopFlights, sweep: Sweep
) -> tuple[Finding, ...]:
    """Findings on straightness, on the order of the response, and on the effect of heading."""
    other_methods = [method for method in PAPER_METHODS if method is not PROPOSED]
    straightest_times = [
        t
        for t, cross_tracks in sweep.items()
        if cross_tracks[PROPOSED] < min(cross_tracks[m] for m in other_methods)
    ]
    times_text = ", ".join(f"{1e3 * t:.0f}" for t in straightest_times)
    return (
        _straightness_finding("paper", "quick", quick_loop),
        _straightness_finding("ours", "as slow as measured", measured_loop),
        Finding(
            "ours",
            "The proposed method is the straightest with every inner loop.",
            len(straightest_times) == len(sweep),
            "At heading 0 it is the straightest with "
            + (
                f"loops of {times_text} ms (63 % of a rate step)"
                if times_text
                else "none of the loops"
            )
            + ". Its cross-track is "
            + ", ".join(f"{cross_tracks[PROPOSED]:.2g}" for cross_tracks in sweep.values())
            + " with "
            + ", ".join(f"{1e3 * t:.0f}" for t in sweep)
            + " ms.",
        ),
        Finding(
            "ours",
            "Heading does not change the response with a complete inner loop either.",
            max(heading_effect(measured_loop.responses[m]) for m in (PROPOSED, QUATERNION, SO3))
            < 1e-3,
            "Largest difference of the paths between any two headings, measured inner loop: "
            + ", ".join(
                f"{m.label} {heading_effect(measured_loop.responses[m]):.2g}" for m in PAPER_METHODS
            )
            + " (required: 0.001).",
        ),
        _second_order_finding("paper", "quick", quick_loop),
        _second_order_finding("ours", "as slow as measured", measured_loop),
    )


def _straightness_finding(claimant: Claimant, speed_text: str, loop: LoopFlights) -> Finding:
    cross_tracks = {m: loop.cross_track(m) for m in (PROPOSED, QUATERNION, SO3, EULER)}
    return Finding(
        claimant,
        f"With a complete inner loop that is {speed_text} ({1e3 * loop.time_to_63_percent:.0f} ms) "
        "the proposed method is still the straightest.",
        cross_tracks[PROPOSED]
        < min(largest for m, largest in cross_tracks.items() if m is not PROPOSED),
        "Cross-track over all headings: "
        + ", ".join(f"{method.label} {largest:.2g}" for method, largest in cross_tracks.items())
        + ".",
    )


def _second_order_finding(claimant: Claimant, speed_text: str, loop: LoopFlights) -> Finding:
    fit, fit_deviation = loop.fitted_models[PROPOSED], loop.deviation_from_second_order(PROPOSED)
    allowed_deviation = _SECOND_ORDER_SHARE * hypot(*np.subtract(FIGURE_2.target, FIGURE_2.start))
    return Finding(
        claimant,
        f"With a complete inner loop that is {speed_text} the response of the proposed method is"
        " second"
        " order.",
        fit_deviation < allowed_deviation,
        f"It stays within {fit_deviation:.2g} of ω = {fit.frequency:.1f} rad/s,"
        f" ζ = {fit.damping:.2f} after a dead time of {1e3 * fit.dead_time:.0f} ms; required"
        f" are 2 % of the step, {allowed_deviation:.2g}.",
    )
