"""Figures of one vehicle's response to steps, compiled.

They are those that `companion.recording.measurements.response` measures in a flight, computed
sample after sample; `tests/campaign/test_kinematics.py` compares both.
"""

from functools import cache
from math import exp, log, nan, sqrt
from typing import Any, NamedTuple

from companion.attitude.reference import first_order_step
from companion.batch.compiler import Compiler
from companion.batch.loops import Array
from companion.batch.rate_loop import StepFlight

_SHORTEST, _LONGEST = log(0.02), log(2.0)
"""Range in which the time constant is searched, logarithms of s."""
_GOLDEN = 0.5 * (sqrt(5.0) - 1.0)
_NARROWINGS = 17
"""Steps of the golden-section search; the range left is 0.13 % of a time constant."""
_ASKED = 1e-3
"""Smallest target coefficient that counts as a step."""


class StepFigures(NamedTuple):
    """Figures of a flight of steps.

    Attributes:
        model_deviation_max: largest distance from the ideal model ċ = p·(c_d − c).
        cross_axis_max: largest distance from the line of a step.
        rate_rms: commanded √(ω_x² + ω_y²), rad/s, RMS.
        rate_max: the largest of them, rad/s.
        time_constant_north: of the first-order model that fits a_N best (least squares), s; NaN if
            there was no step north.
        time_constant_east: the same for a_E.
    """

    model_deviation_max: float
    cross_axis_max: float
    rate_rms: float
    rate_max: float
    time_constant_north: float
    time_constant_east: float


def step_figures(flight: StepFlight, gain: float, period: float) -> StepFigures:
    """Measure a flight.

    Args:
        flight: of `fly_steps`.
        gain: p of the ideal model, 1/s.
        period: time between two samples, s.
    """
    measure, fit = _compiled()
    figures = measure(flight.path, flight.targets, flight.commanded, 1.0 / gain, period)
    constants = [fit(flight.path, flight.targets, axis, period) for axis in (0, 1)]
    return StepFigures(*figures, *constants)


@cache
def _compiled() -> tuple[Any, Any]:
    compiler = Compiler({})
    return compiler.function(_measured), compiler.function(_time_constant)


def _measured(
    path: Array, targets: Array, commanded: Array, time_constant: float, period: float
) -> tuple[float, float, float, float]:
    """The first four of `StepFigures`."""
    model_north, model_east = path[0, 0], path[0, 1]
    begin_north, begin_east = model_north, model_east
    away, across, squares, fastest = 0.0, 0.0, 0.0, 0.0
    for k in range(path.shape[0]):
        north, east = path[k, 0], path[k, 1]
        if k > 0:
            before_north, before_east = targets[k - 1, 0], targets[k - 1, 1]
            _, model_north = first_order_step(model_north, before_north, time_constant, period)
            _, model_east = first_order_step(model_east, before_east, time_constant, period)
            if before_north != targets[k, 0] or before_east != targets[k, 1]:
                begin_north, begin_east = north, east
        away = max(away, (north - model_north) ** 2 + (east - model_east) ** 2)
        way_north, way_east = targets[k, 0] - begin_north, targets[k, 1] - begin_east
        length = max(sqrt(way_north * way_north + way_east * way_east), 1e-9)
        aside = (east - begin_east) * way_north - (north - begin_north) * way_east
        across = max(across, abs(aside) / length)
        square = commanded[k, 0] ** 2 + commanded[k, 1] ** 2
        squares += square
        fastest = max(fastest, square)
    return sqrt(away), across, sqrt(squares / path.shape[0]), sqrt(fastest)


def _time_constant(path: Array, targets: Array, axis: int, period: float) -> float:
    """The time constant that fits one axis best, s, by golden-section search; NaN: no step."""
    asked = 0.0
    for k in range(targets.shape[0]):
        asked = max(asked, abs(targets[k, axis]))
    if asked <= _ASKED:
        return nan
    low, high = _SHORTEST, _LONGEST
    left, right = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    at_left = _squares(path, targets, axis, exp(left), period)
    at_right = _squares(path, targets, axis, exp(right), period)
    for _ in range(_NARROWINGS):
        if at_left < at_right:
            high, right, at_right = right, left, at_left
            left = high - _GOLDEN * (high - low)
            at_left = _squares(path, targets, axis, exp(left), period)
        else:
            low, left, at_left = left, right, at_right
            right = low + _GOLDEN * (high - low)
            at_right = _squares(path, targets, axis, exp(right), period)
    return exp(0.5 * (low + high))


def _squares(path: Array, targets: Array, axis: int, time_constant: float, period: float) -> float:
    """Sum of the squared differences from a first-order model."""
    model, total = path[0, axis], 0.0
    for k in range(1, path.shape[0]):
        _, model = first_order_step(model, targets[k - 1, axis], time_constant, period)
        apart = path[k, axis] - model
        total += apart * apart
    return total
