"""How linear was it: the measured response to acceleration steps against first-order models."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.attitude import coefficients

Floats = NDArray[np.float64]

_GAP = 0.5
"""Rows further apart than this belong to different doublets, s."""


@dataclass(frozen=True, slots=True)
class StepResponse:
    """Measured over all doublets; coefficients are accelerations per specific thrust.

    Attributes:
        time_constant_north_s: of the first-order model that fits a_N best (least squares), s.
        time_constant_east_s: the same for a_E.
        cross_axis_max: largest movement across the line of a step.
        model_deviation_max: largest distance from the ideal model ċ = p·(c_d − c).
    """

    time_constant_north_s: float
    time_constant_east_s: float
    cross_axis_max: float
    model_deviation_max: float


def measure_response(rows: Floats, gain: float) -> StepResponse | None:
    """Measure the rows (N, 7) of `FlightTrace.response`; None where no step was flown.

    Args:
        rows: vehicle time s, quaternion w x y z, target north, target east.
        gain: p of the ideal model, 1/s.
    """
    doublets = [part for part in split_doublets(rows) if len(part) > 10]
    if not doublets:
        return None
    times = [part[:, 0] for part in doublets]
    measured = [np.array([coefficients(tuple(row[1:5])) for row in part]) for part in doublets]
    targets = [part[:, 5:7] for part in doublets]
    deviation, cross = 0.0, 0.0
    for t, c, d in zip(times, measured, targets, strict=True):
        ideal = first_order(t, d, c[0], 1.0 / gain)
        deviation = max(deviation, float(np.hypot(*(c - ideal).T).max()))
        cross = max(cross, _cross_axis(c, d))
    north, east = (
        _fit_time_constant(
            [
                (t, d[:, axis], c[:, axis])
                for t, c, d in zip(times, measured, targets, strict=True)
                if np.abs(d[:, axis]).max() > 1e-3
            ]
        )
        for axis in (0, 1)
    )
    return StepResponse(north, east, cross, deviation)


def _cross_axis(measured: Floats, target: Floats) -> float:
    """Largest distance from the straight lines on which the steps ought to run.

    Each step has its own: from where the vehicle was when the target changed, which in wind is not
    level, to the target.
    """
    changes = np.flatnonzero(np.any(np.diff(target, axis=0), axis=1)) + 1
    largest = 0.0
    for c, d in zip(np.split(measured, changes), np.split(target, changes), strict=True):
        way = d[0] - c[0]
        across = (c - c[0]) @ np.array([-way[1], way[0]]) / max(float(np.hypot(*way)), 1e-9)
        largest = max(largest, float(np.abs(across).max()))
    return largest


def split_doublets(rows: Floats) -> list[Floats]:
    """The rows of each doublet by itself."""
    if len(rows) == 0:
        return []
    return np.split(rows, np.flatnonzero(np.diff(rows[:, 0]) > _GAP) + 1)


def first_order(t: Floats, target: Floats, start: Floats, time_constant: float) -> Floats:
    """Exact response, in discrete time, of τ·ċ = c_d − c to a target held over each sample."""
    decay = np.exp(-np.diff(t) / time_constant)
    out = np.empty_like(target)
    out[0] = start
    for k, factor in enumerate(decay):
        out[k + 1] = target[k] + (out[k] - target[k]) * factor
    return out


def _fit_time_constant(runs: list[tuple[Floats, Floats, Floats]]) -> float:
    """Least squares over τ in 20 ms … 2 s by golden section; NaN without runs."""
    if not runs:
        return float("nan")

    def cost(log_tau: float) -> float:
        tau = float(np.exp(log_tau))
        return sum(float(np.sum((first_order(t, d, c[0], tau) - c) ** 2)) for t, d, c in runs)

    low, high = np.log(0.02), np.log(2.0)
    ratio = (np.sqrt(5.0) - 1.0) / 2.0
    while high - low > 1e-3:
        left, right = high - ratio * (high - low), low + ratio * (high - low)
        if cost(left) < cost(right):
            high = right
        else:
            low = left
    return float(np.exp(0.5 * (low + high)))
