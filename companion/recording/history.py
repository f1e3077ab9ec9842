"""Error, speed, tilt and height of a flight over time, marked with what was flown, as panels."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]

HEIGHTS = (1.0, 1.0, 1.0, 1.4)
"""Relative heights of the panels, from top to bottom."""
_MARGIN = 0.02
"""After the end, as a share of the flight."""
_FOR_NAMES = 1.5
"""Room above the height for the names of the phases."""
_LARGEST = 1e9
"""No time of a flight is larger, s."""
_LINE, _PHASE, _END = "#0072b2", "#666666", "#cc0000"
_SHADES = ("#f0e6c8", "#d5e8f0")
"""Of the maneuvers, one after the other."""
_LONGEST_REASON = 110
"""Largest number of characters of the reason that are drawn; the rest is left out."""
_APART = 0.022
"""Names of phases that begin closer together are joined, as a share of the flight."""
_COLUMNS = (
    ("tracking error", "m", 5),
    ("speed", "m/s", 3),
    ("tilt", "°", 4),
    ("height", "m", 2),
)
"""What each panel shows: its name, unit and column of `FlightTrace.motion`."""


class Span(NamedTuple):
    """A maneuver, from `begin` to `end` in s since the flight began, and what is written there."""

    begin: float
    end: float
    name: str


@dataclass(frozen=True, slots=True)
class Marks:
    """What is marked in the panels; times in s since the flight began.

    Attributes:
        phases: when each began, and its name.
        maneuvers: in order.
        end: when the flight ended early, or None.
        reason: why.
    """

    phases: Sequence[tuple[float, str]] = ()
    maneuvers: Sequence[Span] = ()
    end: float | None = None
    reason: str = ""


def marks_of(summary: Any) -> Marks:
    """The marks in a `summary.json`; none where an older version wrote it.

    Raises:
        ValueError: it is not as a flight writes it.
        TypeError, KeyError, AttributeError: the same.
    """
    if "phases" not in summary:
        return Marks()
    early = summary["early_end"]
    maneuvers = [
        Span(begin := _time(each["begin_s"]), begin + _time(each["duration_s"]), _title(each))
        for each in summary["maneuvers"]
    ]
    return Marks(
        [(_time(each["time_s"]), str(each["name"])) for each in summary["phases"]],
        maneuvers,
        None if early is None else _time(early["time_s"]),
        str(summary["result"]),
    )


def _title(maneuver: Any) -> str:
    """The name of a maneuver; "(open loop)" explains why the error has a gap there."""
    return f"{maneuver['name']}{' (open loop)' if maneuver['open_loop'] else ''}"


def draw_history(panels: Sequence["Axes"], motion: Floats, marks: Marks) -> None:
    """Draw the rows (N, 6) of `FlightTrace.motion` into panels, one below the other."""
    time = motion[:, 0]
    length = max(float(time[-1] - time[0]), 1.0)
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
        axes.set_xlim(float(time[0]), float(time[0]) + (1.0 + _MARGIN) * length)
        low, high = axes.get_ylim()
        axes.set_ylim(min(low, 0.0), high * (_FOR_NAMES if axes is panels[-1] else 1.0))
    panels[-1].set_xlabel("time since the flight began, s")
    for axes in panels[:-1]:
        axes.tick_params(labelbottom=False)
    _name_maneuvers(panels[0], marks)
    _name_phases(panels[-1], marks, length)


def _name_maneuvers(axes: "Axes", marks: Marks) -> None:
    """Above the first panel: the maneuvers, and where and why the flight ended early."""
    for span in marks.maneuvers:
        axes.text(
            0.5 * (span.begin + span.end),
            1.02,
            _plain(span.name),
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
            _plain(f"ended at {marks.end:.1f} s: {reason}"), color=_END, fontsize="medium", pad=18
        )


def _name_phases(axes: "Axes", marks: Marks, length: float) -> None:
    """In the last panel: the phases; those that begin together share a line."""
    groups: list[tuple[float, list[str]]] = []
    for begin, name in marks.phases:
        if groups and begin - groups[-1][0] < _APART * length:
            groups[-1][1].append(name)
        else:
            groups.append((begin, [name]))
    for begin, names in groups:
        axes.text(
            begin,
            0.96,
            " " + _plain(", ".join(names)),
            transform=axes.get_xaxis_transform(),
            rotation=90,
            ha="left",
            va="top",
            fontsize="x-small",
            color=_PHASE,
        )


def _plain(text: str) -> str:
    """Without the sign that would begin a formula."""
    return text.replace("$", r"\$")


def _time(value: Any) -> float:
    time = float(value)
    if not isfinite(time) or abs(time) > _LARGEST:
        raise ValueError(f"a time is {value}")
    return time
