"""Drawing functions of all figures: size, axes, and the lines of a method."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from companion.study.methods import REFERENCE_STYLE, LineStyle, Method
from companion.study.step import Floats, Step

AxisLimits = tuple[float, float]

_THINNED_POINTS = 400
"""Smallest number of points of a thinned line; without thinning a page would have megabytes."""

STYLE: Any = {  # Any, because matplotlib types the keys as a literal of 300 names
    "font.size": 9.0,
    "axes.titlesize": 10.0,
    "axes.grid": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.alpha": 0.3,
    "legend.fontsize": 8.0,
    "legend.frameon": False,
    "svg.hashsalt": "companion",  # the same numbers give the same file
}


def new_figure(
    rows: int, columns: int, height: float = 3.4, width: float = 4.6
) -> tuple[Figure, Any]:
    """A figure and its (rows, columns) array of axes; each panel is `height` by `width` inches."""
    figure = Figure(figsize=(width * columns, height * rows), layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False)


def draw_line(axes: Axes, x: Floats, y: Floats, line: LineStyle, label: str = "") -> None:
    """Draw a line, thinned to fewer than two times `_THINNED_POINTS` points if it has more."""
    stride = max(1, len(x) // _THINNED_POINTS)
    kept_indices = np.unique(np.append(np.arange(0, len(x), stride), len(x) - 1))
    axes.plot(x[kept_indices], y[kept_indices], **line, label=label or None)


def draw_response(
    north: Axes, east: Axes, time: Floats, curves: Iterable[tuple[Method, str, Floats]]
) -> None:
    """Draw the north and east coefficients over time.

    Args:
        north: panel of the north coefficient.
        east: panel of the east coefficient.
        time: (n,), s.
        curves: for each curve its method, label and (n, 2) coefficients.
    """
    for method, label, c in curves:
        for axes, values in ((north, c[:, 0]), (east, c[:, 1])):
            draw_line(axes, time, values, method.line_style, label)
    label_response(north, east)


def label_response(north: Axes, east: Axes) -> None:
    """Set titles and axis labels of the two panels of a response."""
    north.set(title="Response, north", xlabel="time, s", ylabel="$a_N$")
    east.set(title="Response, east", xlabel="time, s", ylabel="$a_E$")


def label_tilt_rate(axes: Axes, title: str) -> None:
    """Set title and units of a panel of tilt rates."""
    axes.set(title=title, xlabel="time, s", ylabel=r"$\sqrt{\omega_x^2+\omega_y^2}$, rad/s")


def draw_reference(
    north: Axes, east: Axes, time: Floats, reference: Floats, label: str = "first-order reference"
) -> None:
    """Draw the (n, 2) coefficients of a reference model over the curves."""
    draw_line(north, time, reference[:, 0], REFERENCE_STYLE, label)
    draw_line(east, time, reference[:, 1], REFERENCE_STYLE, label)


def draw_plane(axes: Axes, curves: Iterable[tuple[Method, str, Floats]], step: Step) -> None:
    """Draw paths of the coefficients, north over east, and the straight line of the step.

    Args:
        axes: the panel.
        curves: for each curve its method, label and (n, 2) coefficients.
        step: the step that was flown.
    """
    for method, label, c in curves:
        draw_line(axes, c[:, 1], c[:, 0], method.line_style, label)
    start, target = step.start, step.target
    axes.plot([start.east, target.east], [start.north, target.north], **REFERENCE_STYLE)
    axes.plot(start.east, start.north, "o", color="black", markersize=4)
    axes.plot(target.east, target.north, "*", color="black", markersize=8)
    axes.set(title="Path (● start, ★ target)", xlabel="$a_E$", ylabel="$a_N$")


def note_magnification(
    axes: Axes, axis: str, limits: AxisLimits, other_axis: str, other_limits: AxisLimits
) -> None:
    """Write below the title of a panel how many times one axis is magnified compared with another.

    Args:
        axes: the panel.
        axis: name of the axis.
        limits: smallest and largest value that the axis shows.
        other_axis: name of the axis that it is compared with.
        other_limits: smallest and largest value that the other axis shows.
    """
    magnification = (other_limits[1] - other_limits[0]) / (limits[1] - limits[0])
    axes.set_title(
        f"{axes.get_title()}\nmagnified: {axis} spans 1/{magnification:.0f} of {other_axis}"
    )
