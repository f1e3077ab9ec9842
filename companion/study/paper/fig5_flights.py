"""The flights of figure 5: every method with a quick and with a measured inner loop."""

from dataclasses import replace
from math import pi
from typing import NamedTuple

from companion.recording.measurements.second_order import SecondOrderModel
from companion.study.inner_loop import faster_inner_loop
from companion.study.measures import (
    cross_track,
    fit_second_order,
    largest_deviation,
    second_order_path,
)
from companion.study.methods import LAW_METHODS, PAPER_METHODS, Method, planner_of
from companion.study.outcome import Tick
from companion.study.step import FIGURE_2, Floats, Response, fly_loop

STEP = replace(FIGURE_2, headings=tuple(k * pi / 4.0 for k in range(-3, 5)))
QUICK_SPEEDUP, MEASURED_SPEEDUP = 5, 1
"""Speeds of the two inner loops relative to the mock vehicle, which responds as a PX4 does."""
_SWEPT_SPEEDUPS = (10, 5, 3, 2, 1)
PROGRESS_STEPS = 2 * len(LAW_METHODS) + len(_SWEPT_SPEEDUPS)

Sweep = dict[float, dict[Method, float]]
"""Cross-track error at heading 0, by `LoopFlights.time_to_63_percent` of the inner loop (s) and by
method."""


class LoopFlights(NamedTuple):
    """Flights of every method with one inner loop."""

    time_to_63_percent: float
    """Time until the roll rate reaches 63 % of a step of its setpoint, s."""
    responses: dict[Method, Response]
    """Response of each method."""
    fitted_models: dict[Method, SecondOrderModel]
    """Second-order model fitted to the response of each method at `worst_heading`."""

    def worst_heading(self, method: Method) -> int:
        """Index of the heading at which a method has its largest cross-track error."""
        return int(cross_track(self.responses[method]).argmax())

    def cross_track(self, method: Method) -> float:
        """Largest cross-track error over all headings."""
        return float(cross_track(self.responses[method]).max())

    def fitted_path(self, method: Method) -> Floats:
        """(samples + 1, 2) coefficients of the model fitted to a method."""
        step = self.responses[method].step
        return second_order_path(step, self.fitted_models[method], step.time)

    def deviation_from_second_order(self, method: Method) -> float:
        """Largest distance of a method's coefficients from its model, at the heading of the fit."""
        model = self.fitted_path(method)
        return float(largest_deviation(self.responses[method], model)[self.worst_heading(method)])

    def __str__(self) -> str:
        return f"63 % in {1e3 * self.time_to_63_percent:.0f} ms"


def fly_methods(speedup: int, tick: Tick) -> LoopFlights:
    """Fly every method with an inner loop `speedup` times as fast as measured on a PX4."""
    inner_loop = faster_inner_loop(speedup)
    flights = LoopFlights(inner_loop.rate_time_to_63_percent(), {}, {})
    for method in LAW_METHODS:
        tick(f"{method.label}, {1e3 * flights.time_to_63_percent:.0f} ms")
        response = fly_loop(planner_of(method, STEP.gain), STEP, inner_loop)
        flights.responses[method] = response
        flights.fitted_models[method] = fit_second_order(
            STEP, response.at_heading(flights.worst_heading(method))
        )
    return flights


def fly_sweep(tick: Tick) -> Sweep:
    """Fly every method of the paper with inner loops of several speeds."""
    step, sweep = replace(FIGURE_2, headings=(0.0,)), {}
    for speedup in _SWEPT_SPEEDUPS:
        inner_loop = faster_inner_loop(speedup)
        time_to_63_percent = inner_loop.rate_time_to_63_percent()
        tick(f"cross-track, {1e3 * time_to_63_percent:.0f} ms")
        sweep[time_to_63_percent] = {
            method: float(cross_track(fly_loop(planner_of(method, STEP.gain), step, inner_loop))[0])
            for method in PAPER_METHODS
        }
    return sweep
