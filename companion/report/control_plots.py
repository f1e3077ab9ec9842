"""Plots of the vehicle's response: coefficients, steps, body rates, thrust and latency."""

from collections.abc import Iterator, Sequence

import numpy as np

from companion.recording.measurements.response import first_order
from companion.recording.measurements.second_order import nearest_second_order
from companion.report.flight_data import FlightData
from companion.report.plots import (
    FLIGHT_COLOURS,
    IDEAL_COLOUR,
    MEASURED_COLOUR,
    NEAREST_COLOUR,
    REFERENCE_COLOUR,
    Plot,
    axes,
    limit_lines,
    line,
    line_over_time,
    time_axis,
)

_STEPS_SHOWN = 6
"""Largest number of doublets in one plot."""


def control_plots(flight: FlightData) -> Iterator[Plot]:
    """The plots of control for one flight, without plots that have no curves."""
    plots = [_step_response(flight), _step_paths(flight), *_coefficients(flight), *_rates(flight)]
    yield from (plot for plot in (*plots, _thrust(flight), _latency(flight)) if plot.traces)


def compared_steps(flights: Sequence[FlightData]) -> Iterator[Plot]:
    """The first doublet of each flight and its nearest linear model; empty without doublets."""
    traces = []
    for number, flight in enumerate(flights):
        if flight.step_runs:
            run, model = flight.step_runs[0], nearest_second_order(flight.step_runs)
            time, direction = run.time - run.time[0], run.direction
            colour = FLIGHT_COLOURS[number % len(FLIGHT_COLOURS)]
            traces.append(line(f"{flight.name}: measured", time, run.measured @ direction, colour))
            nearest_label = (
                f"{flight.name}: nearest model, {1e3 * model.dead_time:.0f} ms dead time"
            )
            traces.append(
                line(nearest_label, time, model.path(run) @ direction, colour, dash="dash")
            )
            traces.append(
                line(f"{flight.name}: target", time, run.target @ direction, colour, dash="dot")
            )
    note = "The first doublet of each flight along its direction. Dashed: the nearest linear model."
    if traces:
        yield Plot("Step responses", note, traces, axes(x="time, s", y="acceleration / thrust"))


def _step_response(flight: FlightData) -> Plot:
    """Plot of the response along the first doublet, with the ideal and the nearest linear model."""
    if not flight.step_runs:
        return Plot("", "", [])
    run, model = flight.step_runs[0], nearest_second_order(flight.step_runs)
    direction, time = run.direction, run.time - run.time[0]
    nearest_label = f"nearest model: {1e3 * model.dead_time:.0f} ms dead time, second order"
    traces = [
        line("target", time, run.target @ direction, REFERENCE_COLOUR, dash="dot"),
        line("measured", time, run.measured @ direction, MEASURED_COLOUR),
        line(nearest_label, time, model.path(run) @ direction, NEAREST_COLOUR, dash="dash"),
    ]
    if np.isfinite(flight.gain):
        ideal_label = f"ideal: first order, {1.0 / flight.gain:.2g} s"
        response = first_order(run.steps(), 1.0 / flight.gain) @ direction
        traces.append(line(ideal_label, time, response, IDEAL_COLOUR))
    note = (
        "The first doublet along its direction. The response is linear if it follows the nearest "
        "model. The vehicle's own rate loop makes that model slower than the ideal."
    )
    return Plot("Step response", note, traces, axes(x="time, s", y="acceleration / thrust"))


def _step_paths(flight: FlightData) -> Plot:
    """The first doublets as paths in the plane of the coefficients, east and north."""
    traces = []
    for number, run in enumerate(flight.step_runs[:_STEPS_SHOWN]):
        colour = FLIGHT_COLOURS[number % len(FLIGHT_COLOURS)]
        north, east = run.measured.T
        traces.append(line(f"{number + 1}, {run.compass_point}", east, north, colour))
    layout = axes(x="a_E, east", y="a_N, north")
    layout["yaxis"]["scaleanchor"] = "x"
    note = "Horizontal acceleration per specific thrust. A linear response moves on straight lines."
    return Plot("Straightness of the steps", note, traces, layout, 420)


def _coefficients(flight: FlightData) -> Iterator[Plot]:
    for column, axis in enumerate(("north", "east")):
        shown = (
            ("target", "target", REFERENCE_COLOUR),
            ("measured", "coefficients", MEASURED_COLOUR),
        )
        traces = [
            line_over_time(label, flight.curves[curve_name], column, colour)
            for label, curve_name, colour in shown
            if curve_name in flight.curves
        ]
        layout = time_axis([flight], y="acceleration / thrust")
        note = "Horizontal acceleration per specific thrust: target, and measured by the tilt."
        yield Plot(f"Acceleration coefficient, {axis}", note, traces, layout, 300)


def _rates(flight: FlightData) -> Iterator[Plot]:
    for column, axis in enumerate(("roll", "pitch", "yaw")):
        traces = [
            line_over_time(curve_name, flight.curves[curve_name], column, colour)
            for curve_name, colour in (
                ("commanded", REFERENCE_COLOUR),
                ("measured", MEASURED_COLOUR),
            )
            if curve_name in flight.curves
        ]
        if traces:
            traces += limit_lines([flight], "rate")
        layout = time_axis([flight], y="rate, °/s")
        note = "The measured rate follows the commanded one after dead time and lag of the vehicle."
        yield Plot(f"Body rate, {axis}", note, traces, layout, 280)


def _thrust(flight: FlightData) -> Plot:
    if "thrust" not in flight.curves:
        return Plot("", "", [])
    traces = [line_over_time("sent", flight.curves["thrust"], 0, MEASURED_COLOUR)]
    if "hover_thrust" in flight.curves:
        learned_curve = flight.curves["hover_thrust"]
        traces.append(
            line_over_time("learned at hover", learned_curve, 0, NEAREST_COLOUR, dash="dash")
        )
    traces += limit_lines([flight], "thrust")
    layout = time_axis([flight], y="thrust, 0..1")
    return Plot("Thrust", "Normalised collective thrust.", traces, layout, 280)


def _latency(flight: FlightData) -> Plot:
    curve = flight.curves.get("latency")
    if curve is None or not curve.values.any():  # In lockstep, all latencies are 0.
        return Plot("", "", [])
    traces = [
        line_over_time("latency", curve, 0, MEASURED_COLOUR),
        *limit_lines([flight], "latency"),
    ]
    layout = time_axis([flight], y="latency, ms")
    note = "From the arrival of a sample to its setpoint, in this program."
    return Plot("Latency", note, traces, layout, 280)
