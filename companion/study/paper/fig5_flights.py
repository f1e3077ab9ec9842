"""The flights of figure 5: every method with a quick and with a measured inner loop."""

from dataclasses import replace
from math import pi
from typing import NamedTuple

from companion.study.inner_loop import quickened
from companion.study.measures import (
    SecondOrderFit,
    cross_track,
    fit_second_order,
    largest_deviation,
    second_order_path,
)
from companion.study.methods import EXACT, PAPERS, Method, planner_of
from companion.study.outcome import Tick
from companion.study.step import FIGURE_2, Floats, Response, fly_loop

STEP = replace(FIGURE_2, headings=tuple(k * pi / 4.0 for k in range(-3, 5)))
METHODS = (*PAPERS, EXACT)
QUICK, MEASURED = 5, 1
"""Speed of the inner loops relative to the mock vehicle, which responds as measured on a PX4."""
_SWEEP = (10, 5, 3, 2, 1)
PARTS = 2 * len(METHODS) + len(_SWEEP)

Sweep = dict[float, dict[Method, float]]
"""`LoopFlights.time_63` of the loop in s -> method -> cross-track at heading 0."""


class LoopFlights(NamedTuple):
    """Every method flown with one inner loop.

    Attributes:
        time_63: time in which a step of the roll rate reaches 63 %, s.
        responses: response of each method.
        fits: second-order model fitted to each response, at the heading `worst`.
    """

    time_63: float
    responses: dict[Method, Response]
    fits: dict[Method, SecondOrderFit]

    def worst(self, method: Method) -> int:
        """Index of the heading with the largest cross-track."""
        return int(cross_track(self.responses[method]).argmax())

    def cross_track(self, method: Method) -> float:
        """Largest cross-track over all headings."""
        return float(cross_track(self.responses[method]).max())

    def fitted_path(self, method: Method) -> Floats:
        """(samples + 1, 2) coefficients of the fitted model."""
        step = self.responses[method].step
        return second_order_path(step, self.fits[method], step.time)

    def from_second_order(self, method: Method) -> float:
        """Largest deviation from the fitted model, at the heading of the fit."""
        model = self.fitted_path(method)
        return float(largest_deviation(self.responses[method], model)[self.worst(method)])

    def __str__(self) -> str:
        return f"63 % in {1e3 * self.time_63:.0f} ms"


def fly_methods(factor: int, tick: Tick) -> LoopFlights:
    """Fly every method with an inner loop `factor` times faster than measured."""
    inner_loop = quickened(factor)
    flown = LoopFlights(inner_loop.rate_step_63(), {}, {})
    for method in METHODS:
        tick(f"{method.label}, {1e3 * flown.time_63:.0f} ms")
        response = fly_loop(planner_of(method, STEP.gain), STEP, inner_loop)
        flown.responses[method] = response
        flown.fits[method] = fit_second_order(STEP, response.at(flown.worst(method)))
    return flown


def fly_sweep(tick: Tick) -> Sweep:
    """Fly every method of the paper with inner loops of several speeds."""
    step, sweep = replace(FIGURE_2, headings=(0.0,)), {}
    for factor in _SWEEP:
        inner_loop = quickened(factor)
        time_63 = inner_loop.rate_step_63()
        tick(f"cross-track, {1e3 * time_63:.0f} ms")
        sweep[time_63] = {
            method: float(cross_track(fly_loop(planner_of(method, STEP.gain), step, inner_loop))[0])
            for method in PAPERS
        }
    return sweep
