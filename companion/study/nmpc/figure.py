"""The figure of the study: paths, errors, solve times."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from companion.study.drawing import draw, new_figure
from companion.study.methods import REFERENCE
from companion.study.nmpc.contest import CIRCLE, EIGHT, Contest, Task
from companion.study.nmpc.contestants import LOOKS, MODELS, RATE_HZ, SQP_ITERATIONS, Contestant

CAPTION = (
    "All models are told the dead time; one iteration a solve. The standing start into the circle,"
    " seen from above, and its error over time; the error on the figure-eight; and the share of the"
    " solves on the figure-eight that took no longer, by one iteration (thin) and to the end"
    " (thick)."
)


def draw_figure(contest: Contest) -> Figure:
    """All panels."""
    figure, ((path, eight), (circle, times)) = new_figure(2, 2)
    _draw_paths(path, contest)
    _draw_errors(circle, contest, CIRCLE, "Error after the standing start")
    _draw_errors(eight, contest, EIGHT, "Error on the figure-eight")
    _draw_times(times, contest)
    circle.set(yscale="log", ylim=(1e-3, None))
    circle.legend(loc="lower left")
    return figure


def _draw_paths(axes: Axes, contest: Contest) -> None:
    for model in MODELS:
        north, east, _ = np.array(contest[CIRCLE.name, Contestant(model)].path).T
        axes.plot(east, north, **LOOKS[model].line)
    begin = CIRCLE.trajectory.at(CIRCLE.begin).position
    times = CIRCLE.begin + np.linspace(0.0, 2.0 * np.pi, 100)
    wanted = np.array([CIRCLE.trajectory.at(float(t)).position for t in times]) - begin
    axes.plot(wanted[:, 1], wanted[:, 0], **REFERENCE)
    axes.plot(0.0, 0.0, "o", color="black", markersize=4)
    low, high = wanted.min(axis=0) - 5.0, wanted.max(axis=0) + 5.0
    axes.set(
        title="Standing start into the circle (● start)",
        xlabel="east, m",
        ylabel="north, m",
        aspect="equal",
        xlim=(low[1], high[1]),
        ylim=(low[0], high[0]),
    )


def _draw_errors(axes: Axes, contest: Contest, task: Task, title: str) -> None:
    for model in MODELS:
        errors = np.array(contest[task.name, Contestant(model)].errors)
        time = (np.arange(len(errors)) + 1) / RATE_HZ
        draw(axes, time, errors, LOOKS[model].line, LOOKS[model].label)
    axes.set(title=title, xlabel="time, s", ylabel="distance, m")


def _draw_times(axes: Axes, contest: Contest) -> None:
    for model in MODELS:
        for iterations, width in ((1, 1.0), (SQP_ITERATIONS, 2.5)):
            times = np.sort(contest[EIGHT.name, Contestant(model, iterations)].seconds)
            share = (np.arange(len(times)) + 1) / len(times)
            axes.plot(1e3 * times, share, **{**LOOKS[model].line, "linewidth": width})
    axes.set(
        title="Processor time of a solve",
        xlabel="time, ms",
        ylabel="share of the solves",
        xlim=(0.0, None),
        ylim=(0.0, 1.0),
    )
