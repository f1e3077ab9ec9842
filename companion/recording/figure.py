"""A flight as a picture: response, straightness, ground track, history. Needs the extra `plot`."""

from collections.abc import Callable
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from companion.extras import require
from companion.recording.flight_record import FlightRecord, RecordError, read_flight
from companion.recording.history import PANEL_HEIGHTS, Marks, draw_history, marks_of
from companion.recording.measurements.recorded_summary import summary_of, trace_of
from companion.recording.measurements.response import first_order
from companion.recording.measurements.second_order import StepRun, nearest_second_order, step_runs
from companion.recording.series import Series
from companion.recording.trace import FlightTrace

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]

# Readable by the colour-blind.
_MEASURED, _IDEAL, _NEAREST, _TARGET = "#0072b2", "#d55e00", "#009e73", "#999999"
_STYLES = ("-", "--", ":")
_WIDTH, _HEIGHT, _HISTORY_HEIGHT = 13.5, 4.4, 7.6
"""Width of the picture, height of its upper panels and of its history, inches."""
_LARGEST_VALID = 1e9
"""Numbers above this, such as times in s and distances in m, are invalid."""
_ROOM_FOR_LEGEND = 0.2
"""Room above the curves, as a share of their height."""


class FigureError(Exception):
    """The picture cannot be drawn; the message says why and what to do."""


def draw_flight(folder: Path, out: Path) -> str | None:
    """Draw the flight recorded in `folder` into the file `out`.

    The suffix of `out` selects the format; without one it is PNG. Returns why not all of the flight
    is drawn, as a sentence; None: all of it is.

    Raises:
        MissingExtraError: matplotlib is missing.
        FigureError: there is nothing to draw, or the suffix of `out` is unknown.
        RecordError: there is no readable record, or it or its summary has invalid values.
        OSError: the picture cannot be written.
    """
    require("matplotlib", "plot", "drawing")
    import matplotlib as mpl  # noqa: PLC0415  an extra, and slow to load

    mpl.use("Agg")
    from matplotlib import pyplot as plt  # noqa: PLC0415

    record = read_flight(folder)
    trace = trace_of(record)
    panels, motion = _panels(record, trace), _checked_rows(record, "motion", trace.motion)
    if not panels and motion is None:
        raise FigureError(f"{folder}: no flight with anything to draw is recorded there")
    marks = Marks() if motion is None else _marks(record)
    above, below = bool(panels) * _HEIGHT, 0.0 if motion is None else _HISTORY_HEIGHT
    heights = [height for height in (above, below) if height]
    figure = plt.figure(figsize=(_WIDTH, sum(heights)), layout="constrained")
    try:
        parts = iter(figure.subfigures(len(heights), 1, squeeze=False, height_ratios=heights)[:, 0])
        if panels:
            grid = next(parts).subplots(1, len(panels), squeeze=False)
            for axes, draw in zip(grid[0], panels, strict=True):
                draw(axes)
        if motion is not None:
            grid = next(parts).subplots(
                len(PANEL_HEIGHTS), 1, sharex=True, height_ratios=PANEL_HEIGHTS
            )
            draw_history(grid, motion, marks)
        # Without a format matplotlib would add a suffix to a name that has none.
        figure.savefig(out, dpi=120, format=out.suffix[1:] or "png")
    except ValueError as error:  # a suffix that matplotlib does not know
        raise FigureError(f"{out}: {error}") from error
    finally:
        plt.close(figure)
    return record.fault


def _panels(record: FlightRecord, trace: FlightTrace) -> "list[Callable[[Axes], None]]":
    """Functions that draw the upper panels."""
    response = _checked_rows(record, "response", trace.response)
    tracking = _checked_rows(record, "tracking", trace.tracking)
    panels: list[Callable[[Axes], None]] = []
    runs = [] if response is None else step_runs(response)
    if runs:
        gain = _gain(record)
        panels += [lambda axes: _draw_steps(axes, runs, gain), lambda axes: _draw_plane(axes, runs)]
    if tracking is not None:
        panels.append(lambda axes: _draw_ground(axes, tracking))
    return panels


def _checked_rows(record: FlightRecord, name: str, series: Series) -> Floats | None:
    """The rows of a series; None if it has none."""
    rows = series.rows()
    # NaN means that there is no value.
    if np.abs(rows[~np.isnan(rows)]).max(initial=0.0) > _LARGEST_VALID:
        raise RecordError(
            f"{record.folder}: {name}: not a valid record of a flight: a number is above "
            f"{_LARGEST_VALID:g}"
        )
    return rows if len(rows) else None


def _gain(record: FlightRecord) -> float:
    try:
        gain = float(record.metadata["flight"]["gain_per_s"])
        if not 0.0 < gain < inf:
            raise ValueError(f"gain_per_s is {gain:g}")
        return gain
    except (ValueError, KeyError) as error:
        raise RecordError(f"{record.folder}: not a valid record of a flight: {error}") from error


def _marks(record: FlightRecord) -> Marks:
    """The phases, the maneuvers and the end that the panels of the history mark."""
    summary, _ = summary_of(record)
    try:
        return marks_of(summary)
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError) as error:
        path = record.folder / "summary.json"
        raise RecordError(f"{path}: not a valid summary of a flight: {error}") from error


def _draw_steps(axes: "Axes", runs: list[StepRun], gain: float) -> None:
    """The first doublet along its direction, with the ideal and the nearest second-order model."""
    run, model = runs[0], nearest_second_order(runs)
    along, time = run.direction, run.time - run.time[0]
    nearest = f"second order, {1e3 * model.dead_time:.0f} ms dead time"
    axes.plot(time, run.target @ along, color=_TARGET, label="target")
    axes.plot(
        time,
        first_order(run, 1.0 / gain) @ along,
        "--",
        color=_IDEAL,
        label=f"ideal, 1/p = {1 / gain:.2g} s",
    )
    axes.plot(time, run.measured @ along, color=_MEASURED, label="measured")
    axes.plot(time, model.path(run) @ along, ":", color=_NEAREST, label=nearest)
    axes.set(
        title="Response to the first doublet", xlabel="time, s", ylabel="acceleration / thrust"
    )
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + _ROOM_FOR_LEGEND * (high - low))
    axes.legend(loc="upper center", fontsize="small", ncols=2, handlelength=1.4, columnspacing=1.0)
    axes.grid(alpha=0.3)


def _draw_plane(axes: "Axes", runs: list[StepRun]) -> None:
    """All doublets, north over east coefficient: a linear response moves on straight lines."""
    for number, run in enumerate(runs):
        style = _STYLES[number % len(_STYLES)]
        north, east = run.measured.T
        axes.plot(east, north, style, color=_MEASURED, label=run.compass)
        axes.plot(run.target[:, 1], run.target[:, 0], "o", color=_TARGET, markersize=4)
    axes.set(title="Straightness of all steps", xlabel="east: $a_E$", ylabel="north: $a_N$")
    axes.set_aspect("equal", adjustable="datalim")
    axes.legend(loc="upper right", fontsize="small")
    axes.grid(alpha=0.3)


def _draw_ground(axes: "Axes", tracking: Floats) -> None:
    """The ground track, and its reference, which has gaps in open-loop steps."""
    if not np.isnan(tracking[:, 1]).all():
        north, east = tracking[:, 1], tracking[:, 2]
        # On top, and thin: a good flight would hide it.
        axes.plot(east, north, "--", color=_IDEAL, linewidth=1.0, zorder=3, label="reference")
    axes.plot(tracking[:, 5], tracking[:, 4], color=_MEASURED, label="flown")
    axes.set(title="Ground track", xlabel="east, m", ylabel="north, m")
    axes.set_aspect("equal", adjustable="datalim")
    axes.legend(loc="center", fontsize="small")
    axes.grid(alpha=0.3)
