"""A flight as a picture: response, straightness and tracking; needs the extra `plot`."""

import json
from collections.abc import Callable
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from companion.extras import require
from companion.recording.response import first_order
from companion.recording.second_order import StepRun, nearest_second_order, step_runs

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]

# Readable by the colour-blind.
_MEASURED, _IDEAL, _NEAREST, _TARGET = "#0072b2", "#d55e00", "#009e73", "#999999"
_STYLES = ("-", "--", ":")
_COLUMNS = 7
"""Of each table that is drawn."""
_LARGEST = 1e9
"""No time in s and no distance in m of a flight is larger."""
_FOR_LEGEND = 0.2
"""Room above the curves, as a share of their height."""


class FigureError(Exception):
    """The picture cannot be drawn; the message says why and what to do."""


def draw_flight(folder: Path, out: Path) -> None:
    """Draw the flight recorded in `folder` into the file `out` (its ending says which kind).

    Raises:
        MissingExtraError: matplotlib is missing.
        FigureError: the folder holds nothing to draw, or `out` is of an unknown kind.
        OSError: the picture cannot be written.
    """
    require("matplotlib", "plot", "drawing")
    import matplotlib as mpl  # noqa: PLC0415  an extra, and slow to load

    mpl.use("Agg")
    from matplotlib import pyplot as plt  # noqa: PLC0415

    response, tracking = _rows(folder / "response.csv"), _rows(folder / "tracking.csv")
    panels: list[Callable[[Axes], None]] = []
    runs = [] if response is None else step_runs(response)
    if runs:
        gain = _gain(folder)
        panels += [lambda axes: _draw_steps(axes, runs, gain), lambda axes: _draw_plane(axes, runs)]
    if tracking is not None:
        track = tracking
        panels.append(lambda axes: _draw_ground(axes, track))
    if not panels:
        raise FigureError(f"{folder}: no flight with anything to draw is recorded there")
    figure, grid = plt.subplots(
        1, len(panels), figsize=(4.5 * len(panels), 4.2), layout="constrained", squeeze=False
    )
    try:
        for axes, draw in zip(grid[0], panels, strict=True):
            draw(axes)
        figure.savefig(out, dpi=120)
    except ValueError as error:  # an ending that matplotlib does not know
        raise FigureError(f"{out}: {error}") from error
    finally:
        plt.close(figure)


def _rows(path: Path) -> Floats | None:
    """The (N, 7) numbers of a CSV file; None where the flight wrote none.

    Raises:
        FigureError: the file is not as `FlightTrace.save` writes it.
    """
    if not path.is_file():
        return None
    try:
        lines = path.read_text(encoding="utf-8").splitlines()[1:]
        if not any(map(str.strip, lines)):
            raise ValueError("it holds no rows")
        rows = np.loadtxt(lines, delimiter=",", comments=None, ndmin=2)
    except ValueError as error:
        raise FigureError(f"{path}: not as a flight writes it: {error}") from error
    if rows.shape[1] != _COLUMNS:
        raise FigureError(
            f"{path}: not as a flight writes it: {rows.shape[1]} columns instead of {_COLUMNS}"
        )
    # NaN stands for a reference that there was not; nothing else is that large.
    if np.abs(rows[~np.isnan(rows)]).max(initial=0.0) > _LARGEST:
        raise FigureError(f"{path}: not as a flight writes it: a number is above {_LARGEST:g}")
    return rows


def _gain(folder: Path) -> float:
    try:
        summary: Any = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        gain = float(summary["gain_per_s"])
        if not 0.0 < gain < inf:
            raise ValueError(f"gain_per_s is {gain:g}")
        return gain
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise FigureError(
            f"{folder / 'summary.json'}: not as a flight writes it: {error}"
        ) from error


def _draw_steps(axes: "Axes", runs: list[StepRun], gain: float) -> None:
    """The first doublet: along its own direction, with the ideal and the nearest linear answer."""
    run, model = runs[0], nearest_second_order(runs)
    along = run.target[0] / np.hypot(*run.target[0])
    time = run.time - run.time[0]
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
    axes.set_ylim(low, high + _FOR_LEGEND * (high - low))
    axes.legend(loc="upper center", fontsize="small", ncols=2)
    axes.grid(alpha=0.3)


def _draw_plane(axes: "Axes", runs: list[StepRun]) -> None:
    """All doublets in the plane of the coefficients: a linear response moves on straight lines."""
    for number, run in enumerate(runs):
        style = _STYLES[number % len(_STYLES)]
        north, east = run.measured.T
        axes.plot(east, north, style, color=_MEASURED, label=_direction(run))
        axes.plot(run.target[:, 1], run.target[:, 0], "o", color=_TARGET, markersize=4)
    axes.set(title="Straightness", xlabel="east: $a_E$", ylabel="north: $a_N$")
    axes.set_aspect("equal")
    axes.legend(loc="upper right", fontsize="small")
    axes.grid(alpha=0.3)


def _direction(run: StepRun) -> str:
    """Where the first step of a doublet points, in words."""
    north, east = np.sign(np.round(run.target[0], 6))
    words = {-1.0: "south", 1.0: "north"}.get(north), {-1.0: "west", 1.0: "east"}.get(east)
    return "-".join(word for word in words if word)


def _draw_ground(axes: "Axes", tracking: Floats) -> None:
    """The ground track beside its reference; open-loop steps have none."""
    axes.plot(tracking[:, 2], tracking[:, 1], "--", color=_IDEAL, label="reference")
    axes.plot(tracking[:, 5], tracking[:, 4], color=_MEASURED, label="flown")
    axes.set(title="Ground track", xlabel="east, m", ylabel="north, m")
    axes.set_aspect("equal")
    axes.legend(loc="center", fontsize="small")
    axes.grid(alpha=0.3)
