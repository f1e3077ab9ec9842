"""The findings of the study `track`: statements, and whether the flights support them."""

from collections.abc import Callable
from math import isfinite

from companion.attitude import PLANNER_NAMES
from companion.attitude.planner import FIRST_ORDER, MODEL_FOLLOWING
from companion.study.outcome import Finding
from companion.study.track.flights import TrackedFlight, TrackedFlights
from companion.study.track.tasks import (
    CALM,
    CIRCLE_AT_5,
    EIGHT_AT_5,
    LINEAR,
    TRAJECTORIES,
    WINDY,
    Task,
    TrajectoryAtSpeed,
)

_EQUALITY_TOLERANCE_M = 2e-4
"""Largest difference of errors that count as equal, m; a new noise seed changes them as much."""
_OTHER_PLANNERS = tuple(planner for planner in PLANNER_NAMES if planner != MODEL_FOLLOWING)
_REQUIRED_RATIO = 3.0
"""Smallest allowed ratio of the error without lead to the error with lead."""
_LARGEST_ERRORS_M = {
    Task(CIRCLE_AT_5, MODEL_FOLLOWING): 0.08,
    Task(EIGHT_AT_5, MODEL_FOLLOWING): 0.06,
    Task(EIGHT_AT_5, MODEL_FOLLOWING, wind=WINDY): 0.12,
}
"""Largest allowed RMS error of each task, m."""

ErrorSelector = Callable[[TrackedFlight], float]
"""Returns one of the errors of a flight, m."""


def make_findings(flights: TrackedFlights) -> tuple[Finding, ...]:
    """All findings, those on the planners first."""
    return (
        _smallest_error_finding(
            flights,
            "In still air no planner has a smaller position error by telemetry than"
            " model-following.",
            lambda flight: flight.telemetry_error.rms,
        ),
        _smallest_error_finding(
            flights,
            "In still air no planner has a smaller true position error than model-following.",
            lambda flight: flight.true_error.rms,
        ),
        _wind_finding(flights),
        *(_lead_finding(flights, wind) for wind in (CALM, WINDY)),
        _required_errors_finding(flights),
    )


def _smallest_error_finding(
    flights: TrackedFlights, statement: str, error: ErrorSelector
) -> Finding:
    def error_of(trajectory: TrajectoryAtSpeed, planner: str) -> float:
        return error(flights[Task(trajectory, planner)])

    our_errors = {trajectory: error_of(trajectory, MODEL_FOLLOWING) for trajectory in TRAJECTORIES}
    best_other_errors = {
        trajectory: min(_OTHER_PLANNERS, key=lambda other: error_of(trajectory, other))
        for trajectory in TRAJECTORIES
    }
    difference = {
        trajectory: our_errors[trajectory] - error_of(trajectory, best_other_errors[trajectory])
        for trajectory in TRAJECTORIES
    }
    larger_on = [
        trajectory
        for trajectory in TRAJECTORIES
        if not difference[trajectory] <= _EQUALITY_TOLERANCE_M
    ]
    smaller_on = [
        trajectory for trajectory in TRAJECTORIES if difference[trajectory] < -_EQUALITY_TOLERANCE_M
    ]
    comparisons = "; ".join(
        f"{trajectory}: {_in_mm(our_errors[trajectory])}, {best_other_errors[trajectory]}"
        f" {_in_mm(error_of(trajectory, best_other_errors[trajectory]))}"
        for trajectory in larger_on
    )
    return Finding(
        "ours",
        statement,
        not larger_on,
        f"Its error is the smallest by more than {1e3 * _EQUALITY_TOLERANCE_M:g} mm on"
        f" {len(smaller_on)} of {len(TRAJECTORIES)} trajectories; on {len(larger_on)} another"
        f" planner is better by more than that{': ' if larger_on else ''}{comparisons}.",
    )


def _wind_finding(flights: TrackedFlights) -> Finding:
    pairs = {
        trajectory: tuple(
            flights[Task(trajectory, planner, wind=WINDY)].telemetry_error.rms
            for planner in (MODEL_FOLLOWING, FIRST_ORDER)
        )
        for trajectory in TRAJECTORIES
    }
    return Finding(
        "ours",
        f"In {WINDY:g} m/s of wind model-following has a smaller error than first-order.",
        all(
            model_following_error < first_order_error
            for model_following_error, first_order_error in pairs.values()
        ),
        "; ".join(
            f"{trajectory}: {_in_mm(model_following_error)} against {_in_mm(first_order_error)}"
            for trajectory, (model_following_error, first_order_error) in pairs.items()
        )
        + ".",
    )


def _lead_finding(flights: TrackedFlights, wind: float) -> Finding:
    ratios = {}
    for trajectory in (CIRCLE_AT_5, EIGHT_AT_5):
        task = Task(trajectory, MODEL_FOLLOWING, LINEAR, wind)
        without_lead, with_lead = flights[task._replace(lead=False)], flights[task]
        ratios[trajectory] = without_lead.telemetry_error.rms / with_lead.telemetry_error.rms
    return Finding(
        "ours",
        f"At 5 m/s in {f'{wind:g} m/s of wind' if wind else 'still air'} the error without lead is"
        f" at least {_REQUIRED_RATIO:g} times the error with lead.",
        all(ratio >= _REQUIRED_RATIO for ratio in ratios.values()),
        "; ".join(f"{trajectory}: {ratio:.1f} times" for trajectory, ratio in ratios.items()) + ".",
    )


def _required_errors_finding(flights: TrackedFlights) -> Finding:
    errors_m = {task: flights[task].telemetry_error.rms for task in _LARGEST_ERRORS_M}
    errors = (
        f"{task}: {_in_mm(errors_m[task])} of {_in_mm(limit)}"
        for task, limit in _LARGEST_ERRORS_M.items()
    )
    return Finding(
        "ours",
        "model-following with linear guidance has an error as small as required.",
        all(errors_m[task] <= limit for task, limit in _LARGEST_ERRORS_M.items()),
        "; ".join(errors) + ".",
    )


def _in_mm(metres: float) -> str:
    return f"{1e3 * metres:.1f} mm" if isfinite(metres) else "failed"
