"""Plots for Plotly as plain data: thinned lines and shaded maneuvers.

Colour-blind readers can distinguish the colours.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from companion.report.early_end import EarlyEndMark
from companion.report.flight_data import Curve, FlightData, Floats, Span

MEASURED_COLOUR, REFERENCE_COLOUR = "#0072b2", "#d55e00"
IDEAL_COLOUR, NEAREST_COLOUR = "#999999", "#009e73"
CROSSED_COLOUR = "#c1121f"
"""Colour of an early end, and of the limit that was crossed."""
FLIGHT_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""One colour for each flight of a comparison."""
_MAX_POINTS = 2000
"""Lines with more points are thinned to about this number, more than the pixels of a screen."""
_MANEUVER_COLOURS = ("rgba(230,159,0,0.13)", "rgba(86,180,233,0.13)")
"""Colours of the maneuvers, used in turn."""
_SIGNIFICANT_DIGITS = 5


@dataclass(frozen=True)
class Plot:
    """One plot of the page."""

    title: str
    note: str
    """Text above the plot: the quantities shown, and how a good flight looks."""
    traces: list[dict[str, Any]]
    layout: dict[str, Any] = field(default_factory=dict)
    """Plotly's layout; the page adds fonts and colours."""
    height: int = 320
    """Height, px."""


def line(
    name: str, x: Floats, y: Floats, colour: str, dash: str = "solid", **options: Any
) -> dict[str, Any]:
    """A line through all points; for many points use `line_over_time`, which thins them."""
    return {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "x": numbers(x),
        "y": numbers(y),
        "line": {"color": colour, "width": 1.6, "dash": dash},
        **options,
    }


def line_over_time(
    name: str, curve: Curve, column: int, colour: str, **options: Any
) -> dict[str, Any]:
    """A column of a curve over time, thinned so that extremes are kept."""
    indices = drawn_indices(curve.values[:, column])
    return line(name, curve.time[indices], curve.values[indices, column], colour, **options)


def drawn_indices(values: Floats) -> Any:
    """Indices (M,) of the points to draw: the extremes of many slices, and a NaN for each gap."""
    count = len(values)
    if count <= _MAX_POINTS:
        return np.arange(count)
    slices = np.array_split(np.arange(count), _MAX_POINTS // 2)
    kept_indices = {0, count - 1}
    for indices in slices:
        valid = indices[~np.isnan(values[indices])]
        if len(valid) < len(indices):  # A gap stays a gap.
            kept_indices.add(int(indices[np.isnan(values[indices])][0]))
        if len(valid):
            kept_indices |= {int(valid[values[valid].argmin()]), int(valid[values[valid].argmax()])}
    return np.array(sorted(kept_indices))


def even_indices(count: int, max_count: int = _MAX_POINTS) -> Any:
    """Indices (M,) of at most `max_count` of `count` points or rows, at even distances."""
    return np.unique(np.linspace(0, count - 1, min(count, max_count)).astype(int))


def numbers(values: Floats) -> list[float | None]:
    """Rounded numbers for JSON; null for values that are not finite."""
    rounded = [float(f"{value:.{_SIGNIFICANT_DIGITS}g}") for value in values.tolist()]
    return [value if np.isfinite(value) else None for value in rounded]


def axes(**titles: str) -> dict[str, Any]:
    """Axis titles for the layout, such as `x="time, s"`; `y2` is the second vertical axis."""
    return {
        f"{axis[0]}axis{axis[1:]}": {"title": {"text": title}} for axis, title in titles.items()
    }


def time_axis(flights: Sequence[FlightData], **titles: str) -> dict[str, Any]:
    """Layout of a plot over whole flights.

    The maneuvers of a single flight are shaded and named above the plot, and its early end is
    marked.
    """
    layout = axes(x="time, s", **titles)
    end_times = [flight.end_time for flight in flights if flight.end_time is not None]
    if end_times:
        layout["xaxis"]["range"] = [0.0, max(end_times)]
    if len(flights) > 1:
        return layout
    maneuvers, early_end = flights[0].maneuvers, flights[0].early_end
    end_shapes = (
        {"shapes": [], "annotations": []} if early_end is None else early_end_shapes(early_end)
    )
    shades = [_maneuver_shade(span, number) for number, span in enumerate(maneuvers)]
    return {
        **layout,
        "shapes": [*shades, *end_shapes["shapes"]],
        "annotations": [*map(_maneuver_label, maneuvers), *end_shapes["annotations"]],
    }


def early_end_shapes(end: EarlyEndMark, *, above: bool = False) -> dict[str, list[dict[str, Any]]]:
    """A line and a label at an early end, for a layout. The reason is the tooltip of the label.

    `above`: whether the label is above the plot; otherwise it is at the bottom of the plot.
    """
    line_at_end = {
        "type": "line",
        "xref": "x",
        "yref": "paper",
        "x0": end.time,
        "x1": end.time,
        "y0": 0,
        "y1": 1,
        "line": {"color": CROSSED_COLOUR, "width": 1.5},
    }
    label = {
        "x": end.time,
        "yref": "paper",
        "xanchor": "right",
        "yanchor": "bottom",
        "showarrow": False,
        "text": f"ended {end.time:.1f} s",
        "hovertext": end.reason,
        "font": {"size": 11, "color": CROSSED_COLOUR},
        "y": 1.0 if above else 0.0,
    }
    return {"shapes": [line_at_end], "annotations": [label]}


def limit_lines(flights: Sequence[FlightData], curve: str, **options: Any) -> list[dict[str, Any]]:
    """Lines at the limit that ended a single flight early, if the limit bounds `curve`."""
    early_end = flights[0].early_end if len(flights) == 1 else None
    if early_end is None or early_end.limit is None or early_end.limit.curve != curve:
        return []
    limit, end_time = early_end.limit, flights[0].end_time
    last_time = early_end.time if end_time is None else end_time
    if limit.outline:
        north, east = np.array(limit.outline).T
        return [line(f"limit: {limit.key}", east, north, CROSSED_COLOUR, dash="dash", **options)]
    return [
        line(
            f"limit: {limit.key}",
            np.array([0.0, last_time]),
            np.array([level, level]),
            CROSSED_COLOUR,
            dash="dash",
            showlegend=number == 0,
            **options,
        )
        for number, level in enumerate(limit.levels)
    ]


def _maneuver_shade(span: Span, number: int) -> dict[str, Any]:
    return {
        "type": "rect",
        "xref": "x",
        "yref": "paper",
        "x0": span.begin,
        "x1": span.end,
        "y0": 0,
        "y1": 1,
        "fillcolor": _MANEUVER_COLOURS[number % len(_MANEUVER_COLOURS)],
        "line": {"width": 0},
        "layer": "below",
    }


def _maneuver_label(span: Span) -> dict[str, Any]:
    """Label of a maneuver; `name` is the duration, s, so that the page can hide too wide labels."""
    return {
        "x": 0.5 * (span.begin + span.end),
        "y": 1.0,
        "yref": "paper",
        "yanchor": "bottom",
        "showarrow": False,
        "text": span.name,
        "name": f"{span.end - span.begin:.3f}",
        "font": {"size": 11},
    }
