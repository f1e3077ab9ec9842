"""Panels of a flight over time: error, speed, tilt and height, with maneuvers and phases marked."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from companion.report.flight_data import FlightData, Span

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PANEL_HEIGHTS = (1.0, 1.0, 1.0, 1.4)
"""Relative heights of the panels, from top to bottom."""
_MARGIN_AFTER_END = 0.02
"""Space on the time axis after the end of the flight, as a share of its duration."""
_NAME_MARGIN_FACTOR = 1.5
"""Factor on the height axis, which leaves space for the names of the phases."""
_LINE_COLOUR, _PHASE_COLOUR, _END_COLOUR = "#0072b2", "#666666", "#cc0000"
_MANEUVER_COLOURS = ("#f0e6c8", "#d5e8f0")
"""Colours of the maneuvers, used in turn."""
_LONGEST_REASON = 110
"""Largest number of characters of the reason that are drawn."""
_MIN_PHASE_DISTANCE_SHARE = 0.022
"""Names of phases that begin closer together than this share of the flight are joined."""
_PANELS = (
    ("tracking error, m", "error", 0),
    ("speed, m/s", "motion", 1),
    ("tilt, °", "motion", 2),
    ("height, m", "motion", 0),
)
"""Title, curve and its column of each panel."""


def draw_history(panels: Sequence["Axes"], flight: FlightData) -> None:
    """Draw the curves "error" and "motion" of a flight into panels, one below the other."""
    time = flight.curves["motion"].time
    begin, length = float(time[0]), max(float(time[-1] - time[0]), 1.0)
    for axes, (title, name, column) in zip(panels, _PANELS, strict=True):
        for number, span in enumerate(flight.maneuvers):
            axes.axvspan(span.begin, span.end, color=_MANEUVER_COLOURS[number % 2], linewidth=0)
        for phase in flight.phases:
            axes.axvline(phase.begin, color=_PHASE_COLOUR, linewidth=0.6, linestyle=":")
        curve = flight.curves.get(name)
        if curve is not None and np.isfinite(curve.values[:, column]).any():
            axes.plot(curve.time, curve.values[:, column], color=_LINE_COLOUR, linewidth=1.2)
        else:  # an empty axis would show invented numbers, even negative errors
            axes.text(0.5, 0.5, "not measured", transform=axes.transAxes, ha="center", va="center")
            axes.set_yticks([])
        if flight.early_end is not None:
            axes.axvline(flight.early_end.time, color=_END_COLOUR, linewidth=1.5)
        axes.set_ylabel(title)
        axes.grid(alpha=0.3)
        axes.set_xlim(begin, begin + (1.0 + _MARGIN_AFTER_END) * length)
        low, high = axes.get_ylim()
        axes.set_ylim(min(low, 0.0), high * (_NAME_MARGIN_FACTOR if axes is panels[-1] else 1.0))
    panels[-1].set_xlabel("time since the flight began, s")
    for axes in panels[:-1]:
        axes.tick_params(labelbottom=False)
    _name_maneuvers(panels[0], flight)
    _name_phases(panels[-1], flight.phases, length)


def _name_maneuvers(axes: "Axes", flight: FlightData) -> None:
    """Write the maneuvers, and time and reason of an early end, above the first panel."""
    for span in flight.maneuvers:
        open_loop = " (open loop)" if _is_open_loop(flight, span) else ""
        axes.text(
            0.5 * (span.begin + span.end),
            1.02,
            _without_formulas(span.name + open_loop),
            transform=axes.get_xaxis_transform(),
            ha="center",
            va="bottom",
            fontsize="small",
        )
    if flight.early_end is not None:
        reason = flight.early_end.reason
        if len(reason) > _LONGEST_REASON:
            reason = f"{reason[:_LONGEST_REASON]}…"
        axes.set_title(
            _without_formulas(f"ended at {flight.early_end.time:.1f} s: {reason}"),
            color=_END_COLOUR,
            fontsize="medium",
            pad=18,
        )


def _is_open_loop(flight: FlightData, span: Span) -> bool:
    """Whether a maneuver has a part without a reference, and so without a tracking error."""
    if "reference" not in flight.curves:
        return False
    time, values = flight.curves["reference"]
    return bool(np.isnan(values[(time >= span.begin) & (time < span.end), 0]).any())


def _name_phases(axes: "Axes", phases: Sequence[Span], length: float) -> None:
    """Write the phases in the last panel; phases that begin close together share a line."""
    groups: list[tuple[float, list[str]]] = []
    for phase in phases:
        if groups and phase.begin - groups[-1][0] < _MIN_PHASE_DISTANCE_SHARE * length:
            groups[-1][1].append(phase.name)
        else:
            groups.append((phase.begin, [phase.name]))
    for begin, names in groups:
        axes.text(
            begin,
            0.96,
            " " + _without_formulas(", ".join(names)),
            transform=axes.get_xaxis_transform(),
            rotation=90,
            ha="left",
            va="top",
            fontsize="x-small",
            color=_PHASE_COLOUR,
        )


def _without_formulas(text: str) -> str:
    """The text with each `$` escaped, which would otherwise begin a formula."""
    return text.replace("$", r"\$")
