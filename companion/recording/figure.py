"""A flight as a picture: response, straightness and tracking; needs the extra `plot`."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from companion.attitude import coefficients
from companion.extras import require
from companion.recording.response import first_order, split_doublets

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]

_MEASURED, _IDEAL, _TARGET = "#0072b2", "#d55e00", "#999999"  # readable by the colour-blind
_STYLES = ("-", "--", ":")


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
    if response is not None:
        rows, gain = response, _gain(folder)
        panels += [lambda axes: _draw_steps(axes, rows, gain), lambda axes: _draw_plane(axes, rows)]
    if tracking is not None:
        track = tracking
        panels.append(lambda axes: _draw_ground(axes, track))
    if not panels:
        raise FigureError(f"{folder}: no flight with anything to draw is recorded there")
    figure, grid = plt.subplots(
        1, len(panels), figsize=(4.5 * len(panels), 4.2), layout="constrained", squeeze=False
    )
    for axes, draw in zip(grid[0], panels, strict=True):
        draw(axes)
    try:
        figure.savefig(out, dpi=120)
    except ValueError as error:  # an ending that matplotlib does not know
        raise FigureError(f"{out}: {error}") from error
    finally:
        plt.close(figure)


def _rows(path: Path) -> Floats | None:
    """The numbers of a CSV file; None where the flight wrote none."""
    if not path.is_file():
        return None
    try:
        return np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)
    except ValueError as error:
        raise FigureError(f"{path}: not as a flight writes it: {error}") from error


def _gain(folder: Path) -> float:
    try:
        summary: Any = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        return float(summary["gain_per_s"])
    except (OSError, ValueError, KeyError) as error:
        raise FigureError(
            f"{folder / 'summary.json'}: not as a flight writes it: {error}"
        ) from error


def _coefficients(rows: Floats) -> Floats:
    return np.array([coefficients(tuple(row[1:5])) for row in rows])


def _draw_steps(axes: "Axes", response: Floats, gain: float) -> None:
    """The first doublet: along its own direction, with the ideal first-order answer."""
    rows = split_doublets(response)[0]
    measured, target = _coefficients(rows), rows[:, 5:7]
    along = target[0] / np.hypot(*target[0])
    time = rows[:, 0] - rows[0, 0]
    ideal = first_order(rows[:, 0], target, measured[0], 1.0 / gain)
    axes.plot(time, target @ along, color=_TARGET, label="target")
    axes.plot(time, ideal @ along, "--", color=_IDEAL, label=f"ideal, 1/p = {1 / gain:.2g} s")
    axes.plot(time, measured @ along, color=_MEASURED, label="measured")
    axes.set(
        title="Response to the first doublet", xlabel="time, s", ylabel="acceleration / thrust"
    )
    axes.legend(loc="upper center", fontsize="small")
    axes.grid(alpha=0.3)


def _draw_plane(axes: "Axes", response: Floats) -> None:
    """All doublets in the plane of the coefficients: a linear response moves on straight lines."""
    for number, rows in enumerate(split_doublets(response)):
        c = _coefficients(rows)
        style = _STYLES[number % len(_STYLES)]
        axes.plot(c[:, 1], c[:, 0], style, color=_MEASURED, label=_direction(rows))
        axes.plot(rows[:, 6], rows[:, 5], "o", color=_TARGET, markersize=4)
    axes.set(title="Straightness", xlabel="east: $a_E$", ylabel="north: $a_N$")
    axes.set_aspect("equal")
    axes.legend(loc="upper right", fontsize="small")
    axes.grid(alpha=0.3)


def _direction(rows: Floats) -> str:
    """Where the first step of a doublet points, in words."""
    north, east = np.sign(np.round(rows[0, 5:7], 6))
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
