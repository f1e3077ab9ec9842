"""The figure of the study `track`: paths, and errors over speed with and without lead and wind."""

from collections.abc import Sequence
from itertools import product

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from companion.attitude.planner import MODEL_FOLLOWING
from companion.study.drawing import draw_line, new_figure
from companion.study.methods import (
    LAW_METHODS,
    MODEL_FOLLOWING_METHOD,
    PROPOSED,
    REFERENCE_STYLE,
    LineStyle,
)
from companion.study.track.flights import TrackedFlights
from companion.study.track.tasks import (
    CALM,
    CIRCLES,
    EIGHTS,
    GUIDANCES,
    LINEAR,
    WINDY,
    Task,
    TrajectoryAtSpeed,
    planners,
)

CAPTION = (
    "Circles on the left, figure-eights on the right. First row: true path at the highest speed in"
    " still air, with model-following. Second row: error of every planner in still air by"
    " telemetry. Third row: true error of the same flights. Last row: with `guidance.lead` and"
    " without, in still air (solid) and in wind (dotted)."
)

_METHODS = (*LAW_METHODS, MODEL_FOLLOWING_METHOD)
_COLOUR_WITHOUT_LEAD = "#D55E00"
_STILL_AIR: LineStyle = {"linestyle": "-", "marker": "o", "markersize": 4.0, "linewidth": 1.6}
_IN_WIND: LineStyle = {"linestyle": ":", "marker": "s", "markersize": 4.0, "linewidth": 1.6}
_ERROR_TICKS_MM = (10, 20, 50, 100, 200, 500, 1000)
_MARKERS = ("o", "s")
"""Plot marker of each guidance in `GUIDANCES`."""


def draw_figure(flights: TrackedFlights) -> Figure:
    """Draw the figure that `CAPTION` describes."""
    telemetry_errors_mm = {
        task: 1e3 * flight.telemetry_error.rms for task, flight in flights.items()
    }
    true_errors_mm = {task: 1e3 * flight.true_error.rms for task, flight in flights.items()}
    figure, panels = new_figure(4, 2)
    for column_panels, trajectories in zip(panels.T, (CIRCLES, EIGHTS), strict=True):
        _draw_paths(column_panels[0], flights, trajectories[-1])
        _draw_planners(column_panels[1], telemetry_errors_mm, trajectories)
        column_panels[1].set_title("All planners in still air, by telemetry")
        _draw_planners(column_panels[2], true_errors_mm, trajectories)
        column_panels[2].set_title("All planners in still air, by the truth")
        _draw_lead_and_wind(column_panels[3], telemetry_errors_mm, trajectories)
    for row in (0, 1, 3):
        panels[row, 0].legend()
    return figure


def _draw_paths(axes: Axes, flights: TrackedFlights, trajectory: TrajectoryAtSpeed) -> None:
    """Draw the reference path, and the true paths with and without lead (`Task.lead`)."""
    with_lead = flights[Task(trajectory, MODEL_FOLLOWING)]
    without_lead = flights[Task(trajectory, MODEL_FOLLOWING, lead=False)]
    draw_line(
        axes,
        with_lead.path[:, 3],
        with_lead.path[:, 2],
        MODEL_FOLLOWING_METHOD.line_style,
        "with lead",
    )
    line_without_lead = {"color": _COLOUR_WITHOUT_LEAD, "linewidth": 1.0}
    draw_line(
        axes, without_lead.path[:, 3], without_lead.path[:, 2], line_without_lead, "without lead"
    )
    draw_line(axes, with_lead.path[:, 1], with_lead.path[:, 0], REFERENCE_STYLE, "reference")
    axes.set(title=f"Path: {trajectory}", xlabel="east, m", ylabel="north, m", aspect="equal")


def _draw_planners(
    axes: Axes, errors: dict[Task, float], trajectories: Sequence[TrajectoryAtSpeed]
) -> None:
    """Draw the error over speed in still air, mm, for every planner and every guidance."""
    for (guidance, marker), method in product(zip(GUIDANCES, _MARKERS, strict=False), _METHODS):
        if method.planner not in planners(guidance):
            continue
        tasks = [Task(trajectory, method.planner, guidance) for trajectory in trajectories]
        label = method.label if guidance == LINEAR else f"{method.label}, {guidance}"
        _draw_over_speed(axes, tasks, errors, {**method.line_style, "marker": marker}, label)
    axes.set_ylim(0.0, None)


def _draw_lead_and_wind(
    axes: Axes, errors: dict[Task, float], trajectories: Sequence[TrajectoryAtSpeed]
) -> None:
    """Draw the error (mm) over the speed, with and without `Task.lead`, without and with wind."""
    for wind, style in ((CALM, _STILL_AIR), (WINDY, _IN_WIND)):
        wind_label = f", wind of {wind:g} m/s" if wind else ""
        for lead, colour in ((True, MODEL_FOLLOWING_METHOD.colour), (False, _COLOUR_WITHOUT_LEAD)):
            tasks = [
                Task(trajectory, MODEL_FOLLOWING, LINEAR, wind, lead) for trajectory in trajectories
            ]
            label = f"model-following{'' if lead else ', without lead'}{wind_label}"
            _draw_over_speed(axes, tasks, errors, {**style, "color": colour}, label)
    tasks = [Task(trajectory, PROPOSED.planner, LINEAR, WINDY) for trajectory in trajectories]
    line = {**_IN_WIND, "color": PROPOSED.colour}
    _draw_over_speed(axes, tasks, errors, line, f"first-order, wind of {WINDY:g} m/s")
    axes.set(
        title="With and without lead, still air and wind", yscale="log", yticks=_ERROR_TICKS_MM
    )
    axes.yaxis.set_major_formatter("{x:g}")
    axes.minorticks_off()


def _draw_over_speed(
    axes: Axes, tasks: Sequence[Task], errors: dict[Task, float], line: LineStyle, label: str
) -> None:
    speeds = [task.trajectory.speed for task in tasks]
    axes.plot(speeds, [errors[task] for task in tasks], **line, label=label)
    axes.set(xlabel="speed, m/s", ylabel="position error, rms, mm", xticks=speeds)
