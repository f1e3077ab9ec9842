"""Figures of one vehicle's response to steps, compiled.

They are those that `companion.recording.measurements.response` measures in a flight, computed
sample after sample; `tests/campaign/test_kinematics.py` compares both.
"""

from functools import cache
from math import exp, log, nan, sqrt
from typing import Any, NamedTuple

import numpy as np

from companion.attitude.reference import first_order_step
from companion.batch.compiler import Compiler
from companion.batch.loops import Array
from companion.batch.rate_loop import StepFlight

_SHORTEST, _LONGEST = log(0.02), log(2.0)
"""Range in which the time constant is searched, as natural logarithms of s."""
_GOLDEN_RATIO = 0.5 * (sqrt(5.0) - 1.0)
_NARROWINGS = 17
"""Steps of the golden-section search; the range left is 0.13 % of a time constant."""
_MIN_STEP = 1e-3
"""Smallest target coefficient of a step; a smaller one counts as level."""


class StepFigures(NamedTuple):
    """Figures of a flight of steps.

    Attributes:
        model_deviation_max: largest distance from the ideal model ċ = p·(c_d − c).
        cross_axis_max: largest distance from the line of a step.
        rate_rms: commanded √(ω_x² + ω_y²), rad/s, RMS.
        rate_max: the largest commanded √(ω_x² + ω_y²), rad/s.
        time_constant_north: of the first-order model that fits the north coefficient best (least
            squares), s; NaN if there was no step north.
        time_constant_east: the same for the east coefficient.
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
        flight: flight of `fly_steps`.
        gain: p of the ideal model, 1/s.
        period: time between two samples, s.
    """
    measure, fit = _compiled()
    figures = measure(flight.path, flight.targets, flight.commanded, 1.0 / gain, period)
    return StepFigures(*figures, *fit(flight.path, flight.targets, period))


@cache
def _compiled() -> tuple[Any, Any]:
    compiler = Compiler({})
    return compiler.function(_measured), compiler.function(_time_constants)


def _measured(
    path: Array, targets: Array, commanded: Array, time_constant: float, period: float
) -> tuple[float, float, float, float]:
    """The first four figures of `StepFigures`."""
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


def _time_constants(path: Array, targets: Array, period: float) -> tuple[float, float]:
    """Time constants of the best fits north and east, s, by golden-section search; NaN: no step.

    Both searches run together, because a processor computes two models in the time of one.
    """
    low, high = np.full(2, _SHORTEST), np.full(2, _LONGEST)
    left, right, tried, asked = np.empty(2), np.empty(2), np.empty(2), np.zeros(2)
    for axis in range(2):
        left[axis] = high[axis] - _GOLDEN_RATIO * (high[axis] - low[axis])
        right[axis] = low[axis] + _GOLDEN_RATIO * (high[axis] - low[axis])
        for k in range(targets.shape[0]):
            asked[axis] = max(asked[axis], abs(targets[k, axis]))
    at_left, at_right, found = np.empty(2), np.empty(2), np.empty(2)
    to_left = np.empty(2, np.bool_)
    _squares(path, targets, left, period, at_left)
    _squares(path, targets, right, period, at_right)
    for _ in range(_NARROWINGS):
        for axis in range(2):
            to_left[axis] = at_left[axis] < at_right[axis]
            if to_left[axis]:
                high[axis], right[axis], at_right[axis] = right[axis], left[axis], at_left[axis]
                left[axis] = high[axis] - _GOLDEN_RATIO * (high[axis] - low[axis])
                tried[axis] = left[axis]
            else:
                low[axis], left[axis], at_left[axis] = left[axis], right[axis], at_right[axis]
                right[axis] = low[axis] + _GOLDEN_RATIO * (high[axis] - low[axis])
                tried[axis] = right[axis]
        _squares(path, targets, tried, period, found)
        for axis in range(2):
            if to_left[axis]:
                at_left[axis] = found[axis]
            else:
                at_right[axis] = found[axis]
    north, east = exp(0.5 * (low[0] + high[0])), exp(0.5 * (low[1] + high[1]))
    return north if asked[0] > _MIN_STEP else nan, east if asked[1] > _MIN_STEP else nan


def _squares(path: Array, targets: Array, logarithms: Array, period: float, found: Array) -> None:
    """Fill in the sums of squared differences from first-order models, north and east.

    Args:
        path: (N, 2), coefficients.
        targets: (N, 2), target coefficients.
        logarithms: (2,), of the time constants, in s.
        period: time between two samples, s.
        found: (2,), is filled.
    """
    constant_north, constant_east = exp(logarithms[0]), exp(logarithms[1])
    north, east, total_north, total_east = path[0, 0], path[0, 1], 0.0, 0.0
    for k in range(1, path.shape[0]):
        _, north = first_order_step(north, targets[k - 1, 0], constant_north, period)
        _, east = first_order_step(east, targets[k - 1, 1], constant_east, period)
        apart_north, apart_east = path[k, 0] - north, path[k, 1] - east
        total_north += apart_north * apart_north
        total_east += apart_east * apart_east
    found[0], found[1] = total_north, total_east
