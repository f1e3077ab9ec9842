"""Measures of a response, such as its cross-track error, and a second-order model fitted to it."""

from math import exp, log

import numpy as np

from companion.least_squares import minimise
from companion.recording.measurements.second_order import RunForModel, SecondOrderModel
from companion.study.step import Floats, Response, Step

_FIT_STRIDE = 10
"""The second-order model is fitted to every sample whose index is a multiple of this number."""
_LOWER_BOUNDS = np.array([log(0.1), log(0.01), 0.0])
"""Lower bounds of log ω (ω in rad/s), log ζ and the dead time (s) in the fit."""
_UPPER_BOUNDS = np.array([log(1000.0), log(100.0), 0.5])
"""Upper bounds of log ω (ω in rad/s), log ζ and the dead time (s) in the fit."""


def deviation(response: Response, reference: Floats) -> Floats:
    """Distance of the acceleration coefficients from a reference.

    `reference`: (samples + 1, 2). Returns (samples + 1, headings).
    """
    difference = response.coefficients - reference[:, :, None]
    return np.asarray(np.hypot(difference[:, 0], difference[:, 1]))


def largest_deviation(response: Response, reference: Floats) -> Floats:
    """(headings,) largest `deviation` from a (samples + 1, 2) reference."""
    return np.asarray(deviation(response, reference).max(axis=0))


def signed_distance_from_line(response: Response) -> Floats:
    """Distance of the acceleration coefficients from the straight line start → target.

    Shape (samples + 1, headings). The distance is positive to the right of the direction to
    the target, seen with north up.
    """
    start, target = np.array(response.step.start), np.array(response.step.target)
    north, east = (target - start) / np.hypot(*(target - start))
    offset = response.coefficients - start[:, None]
    return np.asarray(offset[:, 1] * north - offset[:, 0] * east)


def cross_track(response: Response) -> Floats:
    """(headings,) largest distance of the coefficients from the straight line start → target."""
    return np.asarray(np.abs(signed_distance_from_line(response)).max(axis=0))


def settling_time(response: Response) -> Floats:
    """(headings,) time from which the distance to the target stays within 5 % of the step, s.

    The time is inf if the response ends outside this distance.
    """
    start, target = np.array(response.step.start), np.array(response.step.target)
    offset = response.coefficients - target[:, None]
    is_outside = np.hypot(offset[:, 0], offset[:, 1]) > 0.05 * np.hypot(*(target - start))
    after_last_outside = is_outside.shape[0] - np.argmax(is_outside[::-1], axis=0)
    # The first sample to stay inside.
    settled_index = np.where(is_outside.any(axis=0), after_last_outside, 0)
    time = response.step.time
    return np.where(
        settled_index < len(time), time[np.minimum(settled_index, len(time) - 1)], np.inf
    )


def largest_tilt_rate(response: Response) -> float:
    """Largest √(ω_x² + ω_y²) commanded at any heading, rad/s."""
    return float(response.tilt_rate.max())


def heading_effect(response: Response) -> float:
    """Largest difference of a coefficient between two headings at the same time; 0: no effect."""
    c = response.coefficients
    return float((c.max(axis=2) - c.min(axis=2)).max())


def best_and_worst(values: Floats) -> tuple[int, int]:
    """Indices of the smallest and the largest of (headings,) values; of equal values, the first.

    Values are compared after rounding to 1e-9, because those of the Euler-angle method at opposite
    headings differ only by rounding errors.
    """
    ranked = np.round(values, 9)
    return int(ranked.argmin()), int(ranked.argmax())


def fit_cells(fit: SecondOrderModel) -> dict[str, float]:
    """The cells of a fitted model in a table."""
    return {
        "second order: dead time, ms": 1e3 * fit.dead_time,
        "second order: ω, rad/s": fit.frequency,
        "second order: ζ": fit.damping,
    }


def second_order_path(step: Step, fit: SecondOrderModel, time: Floats) -> Floats:
    """(n, 2) coefficients of the fitted model, from rest, at (n,) times after the step, s."""
    start_state = np.array([step.start, (0.0, 0.0)])
    return fit.path_at_rows(RunForModel(time, start_state, np.zeros(1), np.array([step.target])))


def fit_second_order(step: Step, path: Floats) -> SecondOrderModel:
    """Fit natural frequency, damping ratio and dead time to a response by least squares.

    Args:
        step: the step that was flown.
        path: (samples + 1, 2) coefficients.
    """
    time, measured = step.time[::_FIT_STRIDE], path[::_FIT_STRIDE]

    def residual(unknown: Floats) -> tuple[Floats, Floats]:
        return np.empty(0), (measured - second_order_path(step, _fit_from(unknown), time)).ravel()

    start = np.array([log(2.0 * step.gain), 0.0, 1.0 / step.rate_hz])
    return _fit_from(minimise(residual, start, _LOWER_BOUNDS, _UPPER_BOUNDS).unknowns)


def _fit_from(unknown: Floats) -> SecondOrderModel:
    frequency, damping, dead_time = (float(value) for value in unknown)
    return SecondOrderModel(exp(frequency), exp(damping), dead_time)
