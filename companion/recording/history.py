"""Panels of a flight over time: error, speed, tilt and height, with maneuvers and phases marked."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import isfinite
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]

PANEL_HEIGHTS = (1.0, 1.0, 1.0, 1.4)
"""Relative heights of the panels, from top to bottom."""
_MARGIN_AFTER_END = 0.02
"""Space on the time axis after the end of the flight, as a share of its duration."""
_ROOM_FOR_NAMES = 1.5
"""Factor on the height axis, which leaves space for the names of the phases."""
_LATEST_TIME = 1e9
"""Later times are invalid, s."""
_LINE, _PHASE, _END = "#0072b2", "#666666", "#cc0000"
_SHADES = ("#f0e6c8", "#d5e8f0")
"""Colours of the maneuvers, used in turn."""
_LONGEST_REASON = 110
"""Largest number of characters of the reason that are drawn."""
_JOINED_BELOW = 0.022
"""Names of phases that begin closer together than this share of the flight are joined."""
_COLUMNS = (
    ("tracking error", "m", 5),
    ("speed", "m/s", 3),
    ("tilt", "°", 4),
    ("height", "m", 2),
)
"""Name, unit and column of `FlightTrace.motion` of each panel."""


class Span(NamedTuple):
    """A maneuver, a phase or a mode; times in s since the flight began."""

    begin: float
    end: float
    name: str
    """Shown to the user."""


@dataclass(frozen=True, slots=True)
class Marks:
    """The marks in the panels; times in s since the flight began."""

    phases: Sequence[tuple[float, str]] = ()
    """Beginning and name of each phase."""
    maneuvers: Sequence[Span] = ()
    """The maneuvers, in order."""
    end: float | None = None
    """Time when the flight ended early, or None."""
    reason: str = ""
    """Why the flight ended, if it ended early; else its result."""


def marks_of(summary: Any) -> Marks:
    """The phases, maneuvers and early end in a `summary.json`, to be marked in the plots.

    Raises:
        ValueError: the summary is not valid.
        TypeError, KeyError, AttributeError, OverflowError: the same.
    """
    early = summary["early_end"]
    maneuvers = [
        Span(
            begin := _valid_time(each["begin_s"]),
            begin + _valid_time(each["duration_s"]),
            _title(each),
        )
        for each in summary["maneuvers"]
    ]
    return Marks(
        [(_valid_time(each["time_s"]), str(each["name"])) for each in summary["phases"]],
        maneuvers,
        None if early is None else _valid_time(early["time_s"]),
        str(summary["result"]),
    )


def _title(maneuver: Any) -> str:
    """The name of a maneuver, and "(open loop)" if the panel of the error has a gap there."""
    return f"{maneuver['name']}{' (open loop)' if maneuver['open_loop'] else ''}"


def draw_history(panels: Sequence["Axes"], motion: Floats, marks: Marks) -> None:
    """Draw the rows (N, 6) of `FlightTrace.motion` into panels, one below the other."""
    time = motion[:, 0]
    length = max(float(time[-1] - time[0]), 1.0)
    marks = _marks_until(float(time[-1]), marks)
    for axes, (name, unit, column) in zip(panels, _COLUMNS, strict=True):
        for number, span in enumerate(marks.maneuvers):
            axes.axvspan(span.begin, span.end, color=_SHADES[number % 2], linewidth=0)
        for begin, _ in marks.phases:
            axes.axvline(begin, color=_PHASE, linewidth=0.6, linestyle=":")
        axes.plot(time, motion[:, column], color=_LINE, linewidth=1.2)
        if marks.end is not None:
            axes.axvline(marks.end, color=_END, linewidth=1.5)
        axes.set_ylabel(f"{name}, {unit}")
        axes.grid(alpha=0.3)
        axes.set_xlim(float(time[0]), float(time[0]) + (1.0 + _MARGIN_AFTER_END) * length)
        low, high = axes.get_ylim()
        axes.set_ylim(min(low, 0.0), high * (_ROOM_FOR_NAMES if axes is panels[-1] else 1.0))
    panels[-1].set_xlabel("time since the flight began, s")
    for axes in panels[:-1]:
        axes.tick_params(labelbottom=False)
    _name_maneuvers(panels[0], marks)
    _name_phases(panels[-1], marks, length)


def _marks_until(last: float, marks: Marks) -> Marks:
    """The marks up to time `last` (s), where the rows end: a damaged record ends before its flight.

    A name that is drawn beyond the axes would spoil the layout.
    """
    maneuvers = [
        span._replace(end=min(span.end, last)) for span in marks.maneuvers if span.begin < last
    ]
    phases = [phase for phase in marks.phases if phase[0] <= last]
    return replace(marks, phases=phases, maneuvers=maneuvers)


def _name_maneuvers(axes: "Axes", marks: Marks) -> None:
    """Write above the first panel: the maneuvers, and the time and reason of an early end."""
    for span in marks.maneuvers:
        axes.text(
            0.5 * (span.begin + span.end),
            1.02,
            _without_formulas(span.name),
            transform=axes.get_xaxis_transform(),
            ha="center",
            va="bottom",
            fontsize="small",
        )
    if marks.end is not None:
        reason = marks.reason
        if len(reason) > _LONGEST_REASON:
            reason = f"{reason[:_LONGEST_REASON]}…"
        axes.set_title(
            _without_formulas(f"ended at {marks.end:.1f} s: {reason}"),
            color=_END,
            fontsize="medium",
            pad=18,
        )


def _name_phases(axes: "Axes", marks: Marks, length: float) -> None:
    """Write in the last panel: the phases; those that begin close together share a line."""
    groups: list[tuple[float, list[str]]] = []
    for begin, name in marks.phases:
        if groups and begin - groups[-1][0] < _JOINED_BELOW * length:
            groups[-1][1].append(name)
        else:
            groups.append((begin, [name]))
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
            color=_PHASE,
        )


def _without_formulas(text: str) -> str:
    """The text with each `$` escaped, which would otherwise begin a formula."""
    return text.replace("$", r"\$")


def _valid_time(value: Any) -> float:
    time = float(value)
    if not isfinite(time) or abs(time) > _LATEST_TIME:
        raise ValueError(f"a time is {value}")
    return time
