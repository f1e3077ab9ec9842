"""The numbers of the study: rows for programs, tables for people."""

from math import isfinite
from typing import Any

from companion.attitude import PLANNER_NAMES
from companion.attitude.planner import FIRST_ORDER, MODEL_FOLLOWING
from companion.study.outcome import Cell, Table
from companion.study.track.fleet import Flown
from companion.study.track.flight import Off
from companion.study.track.task import (
    CALM,
    COURSES,
    GUIDANCES,
    LINEAR,
    WINDY,
    Course,
    Task,
    planners,
)

_FAILED = "failed"


def rows(flown: Flown) -> tuple[dict[str, Any], ...]:
    """What `--json` prints: one row a flight that was led; lengths in m, null where it failed.

    The same flight without the lead, where there was one, stands in its row: each trajectory,
    speed, planner, guidance and wind stand in one row alone.
    """
    listed = []
    for task, tracked in flown.items():
        if not task.lead:
            continue
        not_led = flown.get(task._replace(lead=False))
        listed.append(
            {
                "trajectory": task.course.trajectory,
                "speed_mps": task.course.speed,
                "planner": task.planner,
                "guidance": task.guidance,
                "wind_mps": task.wind,
                "position_rms_m": _or_null(tracked.told.rms),
                "position_max_m": _or_null(tracked.told.largest),
                "true_rms_m": _or_null(tracked.true.rms),
                "true_max_m": _or_null(tracked.true.largest),
                "not_led_rms_m": None if not_led is None else _or_null(not_led.told.rms),
                "not_led_max_m": None if not_led is None else _or_null(not_led.told.largest),
                "result": tracked.result,
            }
        )
    return tuple(listed)


def tables(flown: Flown) -> tuple[Table, ...]:
    """Every planner in still air by telemetry and by the truth; lead and wind."""
    return (
        _planners_table(
            "track",
            "Position error in still air by telemetry, root of the mean square, mm.",
            {task: tracked.told.rms for task, tracked in flown.items()},
        ),
        _planners_table(
            "track-largest",
            "The largest position error of the same flights, mm.",
            {task: tracked.told.largest for task, tracked in flown.items()},
        ),
        _planners_table(
            "track-true",
            "The same flights by where the vehicle really was, root of the mean square, mm.",
            {task: tracked.true.rms for task, tracked in flown.items()},
        ),
        _lead_and_wind_table(flown),
    )


def series(flown: Flown) -> Table:
    """Every flight."""
    return Table(
        "track-flights",
        "Every flight.",
        (
            "trajectory",
            "speed, m/s",
            "planner",
            "guidance",
            "wind, m/s",
            "led",
            "rms, m",
            "largest, m",
            "true rms, m",
            "true largest, m",
            "result",
        ),
        tuple(
            (
                task.course.trajectory,
                task.course.speed,
                task.planner,
                task.guidance,
                task.wind,
                "yes" if task.lead else "no",
                *_cells(tracked.told),
                *_cells(tracked.true),
                tracked.result,
            )
            for task, tracked in flown.items()
        ),
    )


def _planners_table(name: str, caption: str, errors: dict[Task, float]) -> Table:
    return Table(
        name,
        caption,
        ("trajectory, guidance", *PLANNER_NAMES),
        tuple(
            (
                f"{course}, {guidance}",
                *(
                    _in_mm(errors[Task(course, planner, guidance)])
                    if planner in planners(guidance)
                    else ""
                    for planner in PLANNER_NAMES
                ),
            )
            for guidance in GUIDANCES
            for course in COURSES
        ),
    )


def _lead_and_wind_table(flown: Flown) -> Table:
    def rms(course: Course, planner: str, wind: float, *, lead: bool = True) -> Cell:
        return _in_mm(flown[Task(course, planner, LINEAR, wind, lead)].told.rms)

    return Table(
        "track-lead-and-wind",
        f"Root of the mean square by telemetry, mm: in still air and in {WINDY:g} m/s of wind, led"
        " and not led. In wind the circle at 7 m/s takes more thrust than there is.",
        (
            "trajectory",
            "still: model-following",
            "still: not led",
            "wind: model-following",
            "wind: not led",
            "wind: first-order",
        ),
        tuple(
            (
                str(course),
                rms(course, MODEL_FOLLOWING, CALM),
                rms(course, MODEL_FOLLOWING, CALM, lead=False),
                rms(course, MODEL_FOLLOWING, WINDY),
                rms(course, MODEL_FOLLOWING, WINDY, lead=False),
                rms(course, FIRST_ORDER, WINDY),
            )
            for course in COURSES
        ),
    )


def _cells(off: Off) -> tuple[Cell, Cell]:
    return _cell(off.rms), _cell(off.largest)


def _in_mm(metres: float) -> Cell:
    return _cell(1e3 * metres)


def _cell(value: float) -> Cell:
    return value if isfinite(value) else _FAILED


def _or_null(value: float) -> float | None:
    return value if isfinite(value) else None
