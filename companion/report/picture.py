"""A flight as a picture: response, straightness, ground track, history. Needs the extra `plot`."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from companion.extras import require
from companion.recording.flight_record import RecordError
from companion.recording.measurements.response import first_order
from companion.recording.measurements.second_order import nearest_second_order
from companion.report import PictureError
from companion.report.flight_data import FlightData, explain_other_version, recorded_flight
from companion.report.picture_history import PANEL_HEIGHTS, draw_history

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Readable by the colour-blind.
_MEASURED_COLOUR, _IDEAL_COLOUR = "#0072b2", "#d55e00"
_NEAREST_COLOUR, _TARGET_COLOUR = "#009e73", "#999999"
_LINE_STYLES = ("-", "--", ":")
_WIDTH, _HEIGHT, _HISTORY_HEIGHT = 13.5, 4.4, 7.6
"""Width of the picture, height of its upper panels and of its history, inches."""
_LARGEST_VALID = 1e9
"""Numbers above this, such as times in s and distances in m, are invalid."""
_LEGEND_MARGIN_SHARE = 0.2
"""Room above the curves, as a share of their height."""


def draw_flight(folder: Path, out: Path) -> str | None:
    """Draw the flight recorded in `folder` into the file `out`.

    The suffix of `out` selects the format; without a suffix the format is PNG. Returns why a part
    of the flight is not drawn, as a sentence; None: everything is drawn.

    Raises:
        MissingExtraError: matplotlib is missing.
        PictureError: there is nothing to draw, or the suffix of `out` is unknown.
        RecordError: there is no readable record, or it or its summary has invalid values.
        OSError: the picture cannot be written.
    """
    require("matplotlib", "plot", "drawing")
    import matplotlib as mpl  # noqa: PLC0415  an extra, and slow to load

    mpl.use("Agg")
    from matplotlib import pyplot as plt  # noqa: PLC0415

    with explain_other_version(folder):
        flight = recorded_flight(folder)
        _check_numbers(flight, folder)
        panels, has_history = _panels(flight), "motion" in flight.curves
    if not panels and not has_history:
        raise PictureError(f"{folder}: no flight with anything to draw is recorded there")
    heights = [_HEIGHT] * bool(panels) + [_HISTORY_HEIGHT] * has_history
    figure = plt.figure(figsize=(_WIDTH, sum(heights)), layout="constrained")
    try:
        subfigures = iter(
            figure.subfigures(len(heights), 1, squeeze=False, height_ratios=heights)[:, 0]
        )
        if panels:
            grid = next(subfigures).subplots(1, len(panels), squeeze=False)
            for axes, draw in zip(grid[0], panels, strict=True):
                draw(axes)
        if has_history:
            grid = next(subfigures).subplots(
                len(PANEL_HEIGHTS), 1, sharex=True, height_ratios=PANEL_HEIGHTS
            )
            draw_history(grid, flight)
        # Without a format matplotlib would add a suffix to a name that has none.
        figure.savefig(out, dpi=120, format=out.suffix[1:] or "png")
    except ValueError as error:  # a suffix that matplotlib does not know
        raise PictureError(f"{out}: {error}") from error
    finally:
        plt.close(figure)
    return flight.fault


def _check_numbers(flight: FlightData, folder: Path) -> None:
    """Refuse a record with a number that is too large to be valid; NaN stands for no number."""
    for name, curve in flight.curves.items():
        for values in curve:
            if np.abs(values[~np.isnan(values)]).max(initial=0.0) > _LARGEST_VALID:
                raise RecordError(
                    f"{folder}: {name}: not a valid record of a flight: a number is above "
                    f"{_LARGEST_VALID:g}"
                )


def _panels(flight: FlightData) -> "list[Callable[[Axes], None]]":
    """Functions that draw the upper panels."""
    panels: list[Callable[[Axes], None]] = []
    if flight.step_runs:
        draw_steps = partial(_draw_steps, flight=flight, ideal=1.0 / flight.gain)
        panels += [draw_steps, partial(_draw_plane, flight=flight)]
    if "position" in flight.curves:
        panels.append(partial(_draw_ground, flight=flight))
    return panels


def _draw_steps(axes: "Axes", flight: FlightData, ideal: float) -> None:
    """The first doublet's component along its direction, with the nearest and the ideal model.

    `ideal` is the time constant of the ideal model, s.
    """
    run, model = flight.step_runs[0], nearest_second_order(flight.step_runs)
    direction, time = run.direction, run.time - run.time[0]
    nearest_label = f"second order, {1e3 * model.dead_time:.0f} ms dead time"
    axes.plot(time, run.target @ direction, color=_TARGET_COLOUR, label="target")
    first_order_response = first_order(run.steps(), ideal) @ direction
    axes.plot(
        time, first_order_response, "--", color=_IDEAL_COLOUR, label=f"ideal, 1/p = {ideal:.2g} s"
    )
    axes.plot(time, run.measured @ direction, color=_MEASURED_COLOUR, label="measured")
    axes.plot(time, model.path(run) @ direction, ":", color=_NEAREST_COLOUR, label=nearest_label)
    axes.set(
        title="Response to the first doublet", xlabel="time, s", ylabel="acceleration / thrust"
    )
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + _LEGEND_MARGIN_SHARE * (high - low))
    axes.legend(loc="upper center", fontsize="small", ncols=2, handlelength=1.4, columnspacing=1.0)
    axes.grid(alpha=0.3)


def _draw_plane(axes: "Axes", flight: FlightData) -> None:
    """Plot the north over the east coefficient of all doublets; a linear response is straight."""
    for number, run in enumerate(flight.step_runs):
        style = _LINE_STYLES[number % len(_LINE_STYLES)]
        north, east = run.measured.T
        axes.plot(east, north, style, color=_MEASURED_COLOUR, label=run.compass_point)
        axes.plot(run.target[:, 1], run.target[:, 0], "o", color=_TARGET_COLOUR, markersize=4)
    axes.set(title="Straightness of all steps", xlabel="east: $a_E$", ylabel="north: $a_N$")
    axes.set_aspect("equal", adjustable="datalim")
    axes.legend(loc="upper right", fontsize="small")
    axes.grid(alpha=0.3)


def _draw_ground(axes: "Axes", flight: FlightData) -> None:
    """The ground track, and its reference, which has gaps in open-loop steps."""
    position, reference = flight.curves["position"].values, flight.curves["reference"].values
    if not np.isnan(reference[:, 0]).all():
        # Drawn on top, because a good flight would cover the reference.
        north, east = reference[:, 0], reference[:, 1]
        axes.plot(
            east, north, "--", color=_IDEAL_COLOUR, linewidth=1.0, zorder=3, label="reference"
        )
    axes.plot(position[:, 1], position[:, 0], color=_MEASURED_COLOUR, label="flown")
    axes.set(title="Ground track", xlabel="east, m", ylabel="north, m")
    axes.set_aspect("equal", adjustable="datalim")
    axes.legend(fontsize="small")
    axes.grid(alpha=0.3)
