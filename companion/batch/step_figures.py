"""Figures of one vehicle's response to steps, compiled.

`companion.recording.measurements.response` measures the same figures in a flight. This module
computes them sample by sample; `tests/campaign/test_kinematics.py` compares both.
"""

from functools import cache
from math import exp, log, nan, sqrt
from typing import Any, NamedTuple

import numpy as np

from companion.attitude.reference import first_order_step
from companion.batch.compiler import Compiler
from companion.batch.loops import Array
from companion.batch.rate_loop import StepFlight

_LOG_SHORTEST_CONSTANT, _LOG_LONGEST_CONSTANT = log(0.02), log(2.0)
"""Range in which the time constant is searched, as natural logarithms of seconds."""
_GOLDEN_SECTION = 0.5 * (sqrt(5.0) - 1.0)
_SEARCH_STEPS = 17
"""Steps of the golden-section search, which narrows the range to 0.13 % of a time constant."""
_MIN_STEP = 1e-3
"""Smallest target coefficient that counts as a step; a smaller one counts as level."""


class StepFigures(NamedTuple):
    """Figures of a flight of steps.

    Attributes:
        model_deviation_max: largest distance of the coefficients from the ideal model
            ċ = p·(c_d − c).
        cross_axis_max: largest distance of the coefficients from the straight line of a step.
        rate_rms: RMS of the commanded roll-pitch rate √(ω_x² + ω_y²), rad/s.
        rate_max: largest commanded roll-pitch rate, rad/s.
        time_constant_north: time constant of the first-order model that fits the north coefficient
            best (least squares), s; NaN if there was no step north.
        time_constant_east: the same for the east coefficient, s; NaN if there was no step east.
    """

    model_deviation_max: float
    cross_axis_max: float
    rate_rms: float
    rate_max: float
    time_constant_north: float
    time_constant_east: float


def step_figures(flight: StepFlight, gain: float, period: float) -> StepFigures:
    """Compute the figures of a flight.

    Args:
        flight: flight of `fly_steps`.
        gain: p of the ideal model, 1/s.
        period: time between two samples, s.
    """
    distances_and_rates, fit_time_constants = _compiled()
    first_figures = distances_and_rates(
        flight.coefficients, flight.targets, flight.commanded_rates, 1.0 / gain, period
    )
    return StepFigures(
        *first_figures, *fit_time_constants(flight.coefficients, flight.targets, period)
    )


@cache
def _compiled() -> tuple[Any, Any]:
    compiler = Compiler({})
    return compiler.compile_function(_distances_and_rates), compiler.compile_function(
        _time_constants
    )


def _distances_and_rates(
    coefficients: Array, targets: Array, commanded_rates: Array, time_constant: float, period: float
) -> tuple[float, float, float, float]:
    """The first four figures of `StepFigures`; `time_constant` is that of the ideal model, s."""
    model_north, model_east = coefficients[0, 0], coefficients[0, 1]
    start_north, start_east = model_north, model_east
    max_square, cross_axis, rate_squares, max_rate_square = 0.0, 0.0, 0.0, 0.0
    for k in range(coefficients.shape[0]):
        north, east = coefficients[k, 0], coefficients[k, 1]
        if k > 0:
            previous_north, previous_east = targets[k - 1, 0], targets[k - 1, 1]
            _, model_north = first_order_step(model_north, previous_north, time_constant, period)
            _, model_east = first_order_step(model_east, previous_east, time_constant, period)
            if previous_north != targets[k, 0] or previous_east != targets[k, 1]:
                start_north, start_east = north, east
        max_square = max(max_square, (north - model_north) ** 2 + (east - model_east) ** 2)
        step_north, step_east = targets[k, 0] - start_north, targets[k, 1] - start_east
        length = max(sqrt(step_north * step_north + step_east * step_east), 1e-9)
        cross_product = (east - start_east) * step_north - (north - start_north) * step_east
        cross_axis = max(cross_axis, abs(cross_product) / length)
        rate_square = commanded_rates[k, 0] ** 2 + commanded_rates[k, 1] ** 2
        rate_squares += rate_square
        max_rate_square = max(max_rate_square, rate_square)
    return (
        sqrt(max_square),
        cross_axis,
        sqrt(rate_squares / coefficients.shape[0]),
        sqrt(max_rate_square),
    )


def _time_constants(coefficients: Array, targets: Array, period: float) -> tuple[float, float]:
    """Time constants of the first-order models that fit north and east best, s; NaN: no step.

    The golden-section searches for north and east run together, because a processor computes two
    models in about the time of one.
    """
    low, high = np.full(2, _LOG_SHORTEST_CONSTANT), np.full(2, _LOG_LONGEST_CONSTANT)
    left, right, new_point, max_target = np.empty(2), np.empty(2), np.empty(2), np.zeros(2)
    for axis in range(2):
        left[axis] = high[axis] - _GOLDEN_SECTION * (high[axis] - low[axis])
        right[axis] = low[axis] + _GOLDEN_SECTION * (high[axis] - low[axis])
        for k in range(targets.shape[0]):
            max_target[axis] = max(max_target[axis], abs(targets[k, axis]))
    cost_left, cost_right, cost_new = np.empty(2), np.empty(2), np.empty(2)
    keep_left = np.empty(2, np.bool_)
    _sums_of_squares(coefficients, targets, left, period, cost_left)
    _sums_of_squares(coefficients, targets, right, period, cost_right)
    for _ in range(_SEARCH_STEPS):
        for axis in range(2):
            keep_left[axis] = cost_left[axis] < cost_right[axis]
            if keep_left[axis]:
                high[axis], right[axis], cost_right[axis] = right[axis], left[axis], cost_left[axis]
                left[axis] = high[axis] - _GOLDEN_SECTION * (high[axis] - low[axis])
                new_point[axis] = left[axis]
            else:
                low[axis], left[axis], cost_left[axis] = left[axis], right[axis], cost_right[axis]
                right[axis] = low[axis] + _GOLDEN_SECTION * (high[axis] - low[axis])
                new_point[axis] = right[axis]
        _sums_of_squares(coefficients, targets, new_point, period, cost_new)
        for axis in range(2):
            if keep_left[axis]:
                cost_left[axis] = cost_new[axis]
            else:
                cost_right[axis] = cost_new[axis]
    north, east = exp(0.5 * (low[0] + high[0])), exp(0.5 * (low[1] + high[1]))
    return north if max_target[0] > _MIN_STEP else nan, east if max_target[1] > _MIN_STEP else nan


def _sums_of_squares(
    coefficients: Array, targets: Array, log_time_constants: Array, period: float, sums: Array
) -> None:
    """Compute the sums of squared differences from first-order models, north and east.

    Args:
        coefficients: (N, 2), coefficients.
        targets: (N, 2), target coefficients.
        log_time_constants: (2,), natural logarithms of the time constants in s.
        period: time between two samples, s.
        sums: (2,), the output.
    """
    constant_north, constant_east = exp(log_time_constants[0]), exp(log_time_constants[1])
    north, east, total_north, total_east = coefficients[0, 0], coefficients[0, 1], 0.0, 0.0
    for k in range(1, coefficients.shape[0]):
        _, north = first_order_step(north, targets[k - 1, 0], constant_north, period)
        _, east = first_order_step(east, targets[k - 1, 1], constant_east, period)
        residual_north, residual_east = coefficients[k, 0] - north, coefficients[k, 1] - east
        total_north += residual_north * residual_north
        total_east += residual_east * residual_east
    sums[0], sums[1] = total_north, total_east
