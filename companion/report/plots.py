"""Plots for Plotly as plain data: lines, thinned, and shaded maneuvers.

The colours can be told apart by the colour-blind.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from companion.report.flight_data import Curve, FlightData, Floats, Span

MEASURED, REFERENCE, IDEAL, NEAREST = "#0072b2", "#d55e00", "#999999", "#009e73"
FLIGHTS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""One colour for each flight of a comparison."""
_MOST_POINTS = 3000
"""Most points of a line: twice the pixels of a wide screen."""
_SHADES = ("rgba(230,159,0,0.13)", "rgba(86,180,233,0.13)")
"""Of the maneuvers, in turn."""
_DIGITS = 5


@dataclass(frozen=True)
class Plot:
    """One plot of the page.

    Attributes:
        title: shown above it.
        note: what to look for, one sentence.
        traces: Plotly's traces.
        layout: Plotly's layout; the page adds fonts and colours.
        height: px.
    """

    title: str
    note: str
    traces: list[dict[str, Any]]
    layout: dict[str, Any] = field(default_factory=dict)
    height: int = 320


def line(name: str, x: Floats, y: Floats, colour: str, **more: Any) -> dict[str, Any]:
    """A line through points that are close enough to need no thinning, such as a track."""
    dash = more.pop("dash", "solid")
    return {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "x": numbers(x),
        "y": numbers(y),
        "line": {"color": colour, "width": 1.6, "dash": dash},
        **more,
    }


def over_time(name: str, curve: Curve, column: int, colour: str, **more: Any) -> dict[str, Any]:
    """A column of a curve over time, thinned: the extremes stay."""
    kept = thinned(curve.values[:, column])
    return line(name, curve.time[kept], curve.values[kept, column], colour, **more)


def thinned(values: Floats) -> Any:
    """Indices (M,) of the points to draw: of each of many equal parts its smallest and largest."""
    count = len(values)
    if count <= _MOST_POINTS:
        return np.arange(count)
    parts = np.array_split(np.arange(count), _MOST_POINTS // 2)
    kept = {0, count - 1}
    for part in parts:
        known = part[~np.isnan(values[part])]
        if len(known) < len(part):  # A gap stays a gap.
            kept.add(int(part[np.isnan(values[part])][0]))
        if len(known):
            kept |= {int(known[values[known].argmin()]), int(known[values[known].argmax()])}
    return np.array(sorted(kept))


def evenly(count: int) -> Any:
    """Indices (M,) of at most so many points of a track that a page stays small."""
    return np.unique(np.linspace(0, count - 1, min(count, _MOST_POINTS)).astype(int))


def numbers(values: Floats) -> list[float | None]:
    """Rounded numbers for JSON; null where a value is not finite."""
    rounded = [float(f"{value:.{_DIGITS}g}") for value in values.tolist()]
    return [value if np.isfinite(value) else None for value in rounded]


def axes(**titles: str) -> dict[str, Any]:
    """The titles of axes, such as `x="time, s"`; `y2` is the second vertical axis."""
    return {
        f"{axis[0]}axis{axis[1:]}": {"title": {"text": title}} for axis, title in titles.items()
    }


def time_axis(flights: Sequence[FlightData], **titles: str) -> dict[str, Any]:
    """Layout of a plot over whole flights; the maneuvers of a single flight are shaded."""
    layout = axes(x="time, s", **titles)
    ends = [flight.phases[-1].end for flight in flights if flight.phases]
    if ends:
        layout["xaxis"]["range"] = [0.0, max(ends)]
    return {**layout, **_shaded(flights[0].maneuvers)} if len(flights) == 1 else layout


def _shaded(spans: tuple[Span, ...]) -> dict[str, Any]:
    shapes = [
        {
            "type": "rect",
            "xref": "x",
            "yref": "paper",
            "x0": span.begin,
            "x1": span.end,
            "y0": 0,
            "y1": 1,
            "fillcolor": _SHADES[number % len(_SHADES)],
            "line": {"width": 0},
            "layer": "below",
            "label": {"text": span.name, "textposition": "top center", "font": {"size": 11}},
        }
        for number, span in enumerate(spans)
    ]
    return {"shapes": shapes}
