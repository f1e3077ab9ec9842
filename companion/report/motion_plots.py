"""Plots of the motion: track, height, tracking error, speed and tilt."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from companion.config.flight import OPEN_LOOP
from companion.report.flight_data import FlightData
from companion.report.plots import (
    CROSSED_COLOUR,
    FLIGHT_COLOURS,
    MEASURED_COLOUR,
    REFERENCE_COLOUR,
    Plot,
    axes,
    even_indices,
    limit_lines,
    line,
    line_over_time,
    numbers,
    time_axis,
)

_NORTH, _EAST, _HEIGHT = range(3)
_CAMERA_POSITION = {"x": 1.3, "y": -1.7, "z": 1.0}
"""Position of the camera: from the south-east and above, far enough to show the axis titles."""
_LONGEST_EDGE = 1.2
"""Longest edge of the box around the track, in Plotly's units, so that the camera sees it all."""


def motion_plots(flights: Sequence[FlightData]) -> Iterator[Plot]:
    """The plots of the motion, without plots that have no curves."""
    plots = (
        _track_from_above(flights),
        _track_in_space(flights),
        _height(flights),
        _error_plot(flights),
        _speed(flights),
    )
    yield from (plot for plot in plots if plot.traces)


def _colour(flights: Sequence[FlightData], number: int) -> str:
    return MEASURED_COLOUR if len(flights) == 1 else FLIGHT_COLOURS[number % len(FLIGHT_COLOURS)]


def _name(flights: Sequence[FlightData], flight: FlightData, label: str) -> str:
    return label if len(flights) == 1 else f"{flight.name}: {label}"


def _track_from_above(flights: Sequence[FlightData]) -> Plot:
    traces = []
    dashes = {"position": "solid", "reference": "dash"}  # the last is on top
    for number, flight in enumerate(flights):
        for curve_name, dash in dashes.items():
            if curve_name in flight.curves:
                values = flight.curves[curve_name].values
                positions = values[even_indices(len(values))]
                is_only_reference = curve_name == "reference" and len(flights) == 1
                colour = REFERENCE_COLOUR if is_only_reference else _colour(flights, number)
                name = _name(flights, flight, "flown" if curve_name == "position" else curve_name)
                east, north = positions[:, _EAST], positions[:, _NORTH]
                traces.append(line(name, east, north, colour, dash=dash))
    traces += [*_end_cross(flights), *limit_lines(flights, "track")]
    layout = axes(x="east, m", y="north, m")
    layout["yaxis"]["scaleanchor"] = "x"
    note = "The track from above."
    if any(span.name in OPEN_LOOP for flight in flights for span in flight.maneuvers):
        note += " In open-loop maneuvers the vehicle has no reference and drifts."
    return Plot("Track", note, traces, layout, 420)


def _end_cross(flights: Sequence[FlightData]) -> list[dict[str, Any]]:
    """A cross at the place where a single flight ended early."""
    flight = flights[0]
    if len(flights) > 1 or flight.early_end is None or "position" not in flight.curves:
        return []
    curve = flight.curves["position"]
    row = min(int(np.searchsorted(curve.time, flight.early_end.time)), len(curve.time) - 1)
    north, east = curve.values[row : row + 1, _NORTH], curve.values[row : row + 1, _EAST]
    marker = {"symbol": "x", "size": 11, "color": CROSSED_COLOUR}
    cross = line("ended early", east, north, CROSSED_COLOUR, mode="markers", marker=marker)
    return [{**cross, "hovertext": flight.early_end.reason}]


def _track_in_space(flights: Sequence[FlightData]) -> Plot:
    """The track in three dimensions; for a single flight with its reference."""
    traces = []
    for number, flight in enumerate(flights):
        colour = _colour(flights, number)
        if "position" in flight.curves:
            traces.append(_track(_name(flights, flight, "flown"), flight, "position", colour))
        if "reference" in flight.curves and len(flights) == 1:
            traces.append(_track("reference", flight, "reference", REFERENCE_COLOUR))
    scene: dict[str, Any] = {
        **axes(x="east, m", y="north, m", z="height, m"),
        "camera": {"eye": _CAMERA_POSITION, "center": {"x": 0.0, "y": 0.0, "z": -0.15}},
    }
    ranges = _cube_ranges(traces)
    for axis, (low, high) in ranges.items():
        scene[f"{axis}axis"]["range"] = [low, high]
    longest = max((high - low for low, high in ranges.values()), default=1.0)
    # Plotly's own aspect "data" makes a narrow box so long that it leaves the picture.
    scene["aspectmode"] = "manual"
    scene["aspectratio"] = {
        axis: _LONGEST_EDGE * (high - low) / longest for axis, (low, high) in ranges.items()
    }
    return Plot("Track in space", "Drag to turn the view.", traces, {"scene": scene}, 520)


def _cube_ranges(traces: Sequence[Mapping[str, Any]]) -> dict[str, tuple[float, float]]:
    """Range of each axis around the tracks, m; each at least half as long as the longest range."""
    values_by_axis = {
        axis: [value for trace in traces for value in trace[axis] if value is not None]
        for axis in "xyz"
    }
    extents = {
        axis: (min(values), max(values)) for axis, values in values_by_axis.items() if values
    }
    longest = max((high - low for low, high in extents.values()), default=0.0) or 1.0
    ranges = {}
    for axis, (low, high) in extents.items():
        middle, half_length = 0.5 * (low + high), 0.52 * max(high - low, 0.5 * longest)
        ranges[axis] = (middle - half_length, middle + half_length)
    return ranges


def _track(name: str, flight: FlightData, curve_name: str, colour: str) -> dict[str, Any]:
    curve = flight.curves[curve_name]
    positions = curve.values[even_indices(len(curve.time))]
    return {
        "type": "scatter3d",
        "mode": "lines",
        "name": name,
        "x": numbers(positions[:, _EAST]),
        "y": numbers(positions[:, _NORTH]),
        "z": numbers(positions[:, _HEIGHT]),
        "line": {"color": colour, "width": 4 if curve_name == "position" else 2},
    }


def _height(flights: Sequence[FlightData]) -> Plot:
    traces = _lines(flights, "motion", "height") + limit_lines(flights, "height")
    layout = time_axis(flights, y="height, m")
    note = "Height above home over the whole flight."
    if any(flight.figures is None for flight in flights):
        note += " The height in a .tlog is relative to the origin of its local frame."
    return Plot("Height", note, traces, layout)


def _error_plot(flights: Sequence[FlightData]) -> Plot:
    traces = _lines(flights, "error", "distance from the reference") + limit_lines(flights, "error")
    layout = time_axis(flights, y="error, m")
    note = (
        "Distance from the reference by the autopilot's estimate. Where the line has a gap, there "
        "is no reference."
    )
    largest_error = _largest_error(flights)
    if largest_error is not None:
        layout["yaxis"]["range"] = [0.0, 1.2 * largest_error]
        note += (
            " Outside of the tracked maneuvers, such as on the way back from steps, the error is "
            "larger: double-click to see all errors."
        )
    return Plot("Tracking error", note, traces, layout)


def _largest_error(flights: Sequence[FlightData]) -> float | None:
    """The largest tracking error that the plot must show, m; None: the plot shows all errors.

    It is the largest error in the maneuvers of a single flight that have a reference from beginning
    to end. None if there are several flights, the flight ended early, it had no such maneuver, or
    no other error is larger.
    """
    flight = flights[0]
    if len(flights) > 1 or flight.early_end is not None or "error" not in flight.curves:
        return None
    time, error = flight.curves["error"].time, flight.curves["error"].values[:, 0]
    errors = [error[(time >= span.begin) & (time < span.end)] for span in flight.maneuvers]
    largest_errors = [each.max() for each in errors if len(each) and not np.isnan(each).any()]
    if not largest_errors or max(largest_errors) >= np.nanmax(error):
        return None
    return float(max(largest_errors))


def _lines(flights: Sequence[FlightData], curve: str, label: str) -> list[dict[str, Any]]:
    """The first column of a curve over time, one line for each flight that has it."""
    return [
        line_over_time(
            _name(flights, flight, label), flight.curves[curve], 0, _colour(flights, number)
        )
        for number, flight in enumerate(flights)
        if curve in flight.curves
    ]


def _speed(flights: Sequence[FlightData]) -> Plot:
    traces = []
    for number, flight in enumerate(flights):
        if "motion" in flight.curves:
            motion, colour = flight.curves["motion"], _colour(flights, number)
            traces.append(line_over_time(_name(flights, flight, "speed, m/s"), motion, 1, colour))
            tilt = _name(flights, flight, "tilt, °")
            tilt_colour = REFERENCE_COLOUR if len(flights) == 1 else colour
            traces.append(line_over_time(tilt, motion, 2, tilt_colour, dash="dot", yaxis="y2"))
    traces += limit_lines(flights, "speed") + limit_lines(flights, "tilt", yaxis="y2")
    layout = time_axis(flights, y="speed, m/s", y2="tilt, °")
    layout["yaxis2"] |= {"overlaying": "y", "side": "right", "showgrid": False, "tickmode": "auto"}
    return Plot("Speed and tilt", "Solid: speed. Dotted: tilt.", traces, layout)
