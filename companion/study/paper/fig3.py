"""Figure 3: the Euler-angle method at headings every π/36."""

from math import degrees

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from companion.study.drawing import draw_line, draw_reference, label_response, new_figure
from companion.study.measures import best_and_worst, cross_track, largest_deviation
from companion.study.methods import EULER, PROPOSED, planner_of
from companion.study.outcome import Finding, Outcome, Table, Tick
from companion.study.step import FIGURE_2, Floats, Response, fly

_ANGLE_COLOURS = colormaps["viridis"]
"""Colour map over the angle between the heading and the axis of the step, 0° to 90°."""
PROGRESS_STEPS = 2


def run(tick: Tick) -> Outcome:
    """Fly the step of figure 2 with Euler angles at every heading."""
    tick(EULER.label)
    response = fly(planner_of(EULER, FIGURE_2.gain), FIGURE_2)
    reference = FIGURE_2.reference()
    deviations = largest_deviation(response, reference)
    best_heading, worst_heading = best_and_worst(deviations)
    tick(PROPOSED.label)
    proposed_deviations = largest_deviation(
        fly(planner_of(PROPOSED, FIGURE_2.gain), FIGURE_2), reference
    )
    heading_deg = [round(degrees(heading)) for heading in FIGURE_2.headings]
    return Outcome(
        name="fig3",
        title="Figure 3: Euler angles at every heading",
        conditions="The step of figure 2 with the Euler-angle method, 72 headings π/36 apart.",
        figure=_figure(response, reference),
        caption=(
            "One line for each heading, from dark (along the step) to bright (across it): both"
            " coefficients, the paths, and the largest deviation by heading."
        ),
        tables=(
            Table(
                "fig3",
                "The Euler-angle method by heading.",
                tuple(
                    {
                        "heading, °": heading,
                        "largest deviation from first order": float(deviation),
                        "cross-track": float(distance),
                    }
                    for heading, deviation, distance in zip(
                        heading_deg, deviations, cross_track(response), strict=True
                    )
                ),
            ),
        ),
        findings=(
            Finding(
                "ours",
                "The Euler-angle method is much better at some headings than at others.",
                bool(deviations[best_heading] < 0.5 * deviations[worst_heading]),
                f"Largest deviation {deviations[best_heading]:.2g} at the best heading,"
                f" {heading_deg[best_heading]}°, and {deviations[worst_heading]:.2g} at the worst,"
                f" {heading_deg[worst_heading]}°. The proposed method has"
                f" {proposed_deviations.max():.2g} at every heading.",
            ),
        ),
    )


def _figure(response: Response, reference: Floats) -> Figure:
    figure, ((north, east), (deviation_panel, plane)) = new_figure(2, 2)
    time, headings = FIGURE_2.time, np.degrees(FIGURE_2.headings)
    angle_to_step = np.abs((headings + 90.0) % 180.0 - 90.0)
    colour_scale = ScalarMappable(Normalize(0.0, 100.0), _ANGLE_COLOURS)
    colours = colour_scale.to_rgba(angle_to_step)
    for k in np.argsort(-angle_to_step):
        line = {"color": colours[k], "linewidth": 0.8}
        c = response.at_heading(k)
        draw_line(north, time, c[:, 0], line)
        draw_line(east, time, c[:, 1], line)
        draw_line(plane, c[:, 1], c[:, 0], line)
    draw_reference(north, east, time, reference)
    label_response(north, east)
    plane.set(
        title="Paths (ideal: a straight line at $a_E$ = −0.5)", xlabel="$a_E$", ylabel="$a_N$"
    )
    largest = largest_deviation(response, reference)
    deviation_panel.scatter(headings, largest, c=colours, s=14, zorder=3)
    deviation_panel.plot(headings, largest, **{"color": "#888888", "linewidth": 0.8})
    deviation_panel.set(
        title="Largest deviation by heading",
        xlabel="heading, °",
        ylabel="max |c − reference|",
        xticks=np.arange(-180, 181, 60),
        ylim=(0.0, None),
    )
    colour_bar = figure.colorbar(
        colour_scale, ax=[east, plane], ticks=[0, 30, 60, 90], boundaries=range(91)
    )
    colour_bar.set_label("angle between heading and the step's axis, °")
    north.legend(loc="lower right")
    return figure
