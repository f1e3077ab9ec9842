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
    COURSES,
    EIGHT_AT_5,
    LINEAR,
    WINDY,
    Course,
    Task,
)

_EQUAL_WITHIN_M = 2e-4
"""Errors that differ by at most this count as equal, m: another noise seed changes them as much."""
_OTHERS = tuple(planner for planner in PLANNER_NAMES if planner != MODEL_FOLLOWING)
_REQUIRED_RATIO = 3.0
"""Smallest allowed ratio of the error without lead to the error with lead."""
_REQUIRED = {
    Task(CIRCLE_AT_5, MODEL_FOLLOWING): 0.08,
    Task(EIGHT_AT_5, MODEL_FOLLOWING): 0.06,
    Task(EIGHT_AT_5, MODEL_FOLLOWING, wind=WINDY): 0.12,
}
"""Largest allowed error of each task, m."""

Error = Callable[[TrackedFlight], float]
"""Selects an error of a flight, m."""


def find(flights: TrackedFlights) -> tuple[Finding, ...]:
    """All findings, those on the planners first."""
    return (
        _smallest(
            flights,
            "In still air no planner has a smaller position error by telemetry than"
            " model-following.",
            _telemetry_rms,
        ),
        _smallest(
            flights,
            "In still air no planner has a smaller true position error than model-following.",
            lambda flight: flight.true_error.rms,
        ),
        _in_wind(flights),
        *(_lead_finding(flights, wind) for wind in (CALM, WINDY)),
        _small_enough(flights),
    )


def _telemetry_rms(flight: TrackedFlight) -> float:
    """RMS error of the position that guidance received, m."""
    return flight.telemetry_error.rms


def _smallest(flights: TrackedFlights, statement: str, error: Error) -> Finding:
    def error_of(course: Course, planner: str) -> float:
        return error(flights[Task(course, planner)])

    ours = {course: error_of(course, MODEL_FOLLOWING) for course in COURSES}
    best = {course: min(_OTHERS, key=lambda other: error_of(course, other)) for course in COURSES}
    difference = {course: ours[course] - error_of(course, best[course]) for course in COURSES}
    larger_on = [course for course in COURSES if not difference[course] <= _EQUAL_WITHIN_M]
    smaller_on = [course for course in COURSES if difference[course] < -_EQUAL_WITHIN_M]
    comparisons = "; ".join(
        f"{course}: {_in_mm(ours[course])}, {best[course]} {_in_mm(error_of(course, best[course]))}"
        for course in larger_on
    )
    return Finding(
        "ours",
        statement,
        not larger_on,
        f"Its error is the smallest by more than {1e3 * _EQUAL_WITHIN_M:g} mm on {len(smaller_on)}"
        f" of {len(COURSES)} courses; on {len(larger_on)} another planner is better by more than"
        f" that{': ' if larger_on else ''}{comparisons}.",
    )


def _in_wind(flights: TrackedFlights) -> Finding:
    pairs = {
        course: tuple(
            _telemetry_rms(flights[Task(course, planner, wind=WINDY)])
            for planner in (MODEL_FOLLOWING, FIRST_ORDER)
        )
        for course in COURSES
    }
    return Finding(
        "ours",
        f"In {WINDY:g} m/s of wind model-following has a smaller error than first-order.",
        all(
            model_following_error < first_order_error
            for model_following_error, first_order_error in pairs.values()
        ),
        "; ".join(
            f"{course}: {_in_mm(model_following_error)} against {_in_mm(first_order_error)}"
            for course, (model_following_error, first_order_error) in pairs.items()
        )
        + ".",
    )


def _lead_finding(flights: TrackedFlights, wind: float) -> Finding:
    ratios = {}
    for course in (CIRCLE_AT_5, EIGHT_AT_5):
        task = Task(course, MODEL_FOLLOWING, LINEAR, wind)
        ratios[course] = _telemetry_rms(flights[task._replace(lead=False)]) / _telemetry_rms(
            flights[task]
        )
    return Finding(
        "ours",
        f"At 5 m/s in {f'{wind:g} m/s of wind' if wind else 'still air'} the error without lead is"
        f" at least {_REQUIRED_RATIO:g} times the error with lead.",
        all(ratio >= _REQUIRED_RATIO for ratio in ratios.values()),
        "; ".join(f"{course}: {ratio:.1f} times" for course, ratio in ratios.items()) + ".",
    )


def _small_enough(flights: TrackedFlights) -> Finding:
    errors_m = {task: _telemetry_rms(flights[task]) for task in _REQUIRED}
    errors = (
        f"{task}: {_in_mm(errors_m[task])} of {_in_mm(limit)}" for task, limit in _REQUIRED.items()
    )
    return Finding(
        "ours",
        "model-following with linear guidance has an error as small as required.",
        all(errors_m[task] <= limit for task, limit in _REQUIRED.items()),
        "; ".join(errors) + ".",
    )


def _in_mm(metres: float) -> str:
    return f"{1e3 * metres:.1f} mm" if isfinite(metres) else "failed"
