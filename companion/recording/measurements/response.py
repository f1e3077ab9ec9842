"""The measured response to acceleration steps, compared with linear models."""

from dataclasses import dataclass
from math import asin, degrees, nan
from typing import Any

import numpy as np

from companion.least_squares import Floats, minimise
from companion.recording.measurements.maneuver_figures import without_nan
from companion.recording.measurements.second_order import (
    SecondOrderModel,
    StepRun,
    largest_norm,
    nearest_second_order,
    step_runs,
)

_TIME_CONSTANT_RANGE = (0.02, 2.0)
"""Range in which the time constant is searched, s."""
_MIN_CHANGE_SHARE = 0.1
"""A step counts for an axis (north or east) if its component along the axis is at least this share
of the step; a smaller component is noise or wind."""


@dataclass(frozen=True, slots=True)
class StepResponse:
    """The response to all steps; coefficients are accelerations per specific thrust."""

    time_constant_north_s: float
    """Time constant of the first-order model that fits the north coefficient best (least squares),
    s; NaN: no step goes north or south."""
    time_constant_east_s: float
    """Time constant of the first-order model that fits the east coefficient best, s; NaN: no step
    goes east or west."""
    step_size: float
    """Largest commanded change of the coefficients, relative to their values before the steps; in
    wind these values are not 0."""
    target_tilt: float
    """Largest tilt of a target, rad, before the tilt limit of the planner."""
    cross_axis_max: float
    """Straightness: largest distance of the coefficients from the straight line to the target of
    their step."""
    model_deviation_max: float
    """Largest distance of the coefficients c from the ideal model ċ = p·(c_d − c)."""
    second_order: SecondOrderModel
    """The second-order model with a dead time that fits best."""
    second_order_deviation_max: float
    """Largest distance of the coefficients from the model `second_order`."""


def measure_response(rows: Floats, gain: float) -> StepResponse | None:
    """Measure the rows (N, 7) of `FlightTrace.response`; None without steps.

    `gain` is p of the ideal model, 1/s.
    """
    runs = step_runs(rows)
    if not runs:
        return None
    second_order = nearest_second_order(runs)
    return StepResponse(
        time_constant_north_s=_time_constant(runs, 0, 1.0 / gain),
        time_constant_east_s=_time_constant(runs, 1, 1.0 / gain),
        step_size=max(run.largest_change for run in runs),
        target_tilt=asin(min(1.0, max(largest_norm(run.target) for run in runs))),
        cross_axis_max=max(_largest_deviation(step) for run in runs for step in run.steps()),
        model_deviation_max=max(
            largest_norm(run.measured - first_order(run.steps(), 1.0 / gain)) for run in runs
        ),
        second_order=second_order,
        second_order_deviation_max=max(
            largest_norm(run.measured - second_order.path(run)) for run in runs
        ),
    )


def response_as_dict(response: StepResponse | None) -> dict[str, Any]:
    """The response as JSON; null for what was not measured, such as an axis without a step."""
    if response is None:
        model = dict.fromkeys(("frequency_rad_s", "damping", "dead_time_s", "deviation_max"))
        names = "step_size", "asked_tilt_deg", "cross_axis_max", "model_deviation_max"
        constants = dict.fromkeys(("north", "east"))
        return {"time_constant_s": constants, **dict.fromkeys(names), "second_order": model}
    fit = response.second_order
    return {
        "time_constant_s": without_nan(
            {"north": response.time_constant_north_s, "east": response.time_constant_east_s}
        ),
        "step_size": response.step_size,
        "asked_tilt_deg": degrees(response.target_tilt),
        "cross_axis_max": response.cross_axis_max,
        "model_deviation_max": response.model_deviation_max,
        "second_order": {
            "frequency_rad_s": fit.frequency,
            "damping": fit.damping,
            "dead_time_s": fit.dead_time,
            "deviation_max": response.second_order_deviation_max,
        },
    }


def first_order(steps: list[StepRun], time_constant: float) -> Floats:
    """(n, 2), exact response of τ·ċ = c_d − c to the targets c_d of a run.

    Args:
        steps: the steps of the run (`StepRun.steps`); the response starts at their first row.
        time_constant: τ, s.
    """
    step_start, start, target = steps[0].time[0], steps[0].measured[0], steps[0].target[0]
    step_responses = []
    for step in steps:
        start = target + (start - target) * np.exp(-(step.time[0] - step_start) / time_constant)
        step_start, target = step.time[0], step.target[0]
        decay = np.exp(-(step.time - step_start) / time_constant)
        step_responses.append(target + np.outer(decay, start - target))
    return np.concatenate(step_responses)


def _largest_deviation(step: StepRun) -> float:
    """Largest distance of the coefficients in a step from the straight line to its target.

    The line begins at the coefficients when the target changed; in wind these are not 0.
    """
    north, east = step.direction
    cross_axis_deviation = (step.measured - step.measured[0]) @ np.array([-east, north])
    return float(np.abs(cross_axis_deviation).max())


def _time_constant(runs: list[StepRun], axis: int, start: float) -> float:
    """The time constant in s that fits one axis best, searched from `start`; NaN without a step."""
    axis_runs = [
        StepRun(run.time, run.measured[:, [axis]], run.target[:, [axis]])
        for run in runs
        if np.abs(run.changes[:, axis]).max() > _MIN_CHANGE_SHARE * run.largest_change
    ]
    if not axis_runs:
        return nan

    steps = [run.steps() for run in axis_runs]
    measured = np.concatenate([run.measured for run in axis_runs])

    def residuals(log_time_constant: Floats) -> tuple[Floats, Floats]:
        tau = float(np.exp(log_time_constant[0]))
        paths = np.concatenate([first_order(each, tau) for each in steps])
        return np.empty(0), (measured - paths).ravel()

    lower_bound, upper_bound = np.log(_TIME_CONSTANT_RANGE)
    fit = minimise(residuals, np.log([start]), np.array([lower_bound]), np.array([upper_bound]))
    return float(np.exp(fit.unknowns[0]))
