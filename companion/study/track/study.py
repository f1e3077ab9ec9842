"""The study `track`: flights, tables, rows for `--json`, and section of the page."""

from math import inf, isfinite
from typing import Any

from companion.attitude import PLANNER_NAMES
from companion.attitude.planner import FIRST_ORDER, MODEL_FOLLOWING
from companion.study.outcome import Cell, Outcome, Table, Tick
from companion.study.track.figure import CAPTION, draw_figure
from companion.study.track.findings import make_findings
from companion.study.track.flights import (
    GUST_SHARE,
    MAX_TILT_DEG,
    MAX_TILT_RATE_DEG_S,
    POSITION_RATE_HZ,
    PositionError,
    TrackedFlights,
    fly_all,
)
from companion.study.track.tasks import (
    CALM,
    GUIDANCES,
    HALF_WIDTH_M,
    LINEAR,
    RADIUS_M,
    TRAJECTORIES,
    WINDY,
    Task,
    TrajectoryAtSpeed,
    planners,
    tasks,
)

PROGRESS_STEPS = len(tasks())

_FAILED = "failed"


def run(tick: Tick) -> Outcome:
    """Fly every task, and measure its position error.

    Raises:
        ConfigError: as `fly_all`.
    """
    flights = fly_all(tasks(), tick)
    return Outcome(
        name="track",
        title="Track: position error on trajectories",
        conditions=(
            f"A circle of {RADIUS_M:g} m radius at a steady speed and a figure-eight (Gerono) of"
            f" {HALF_WIDTH_M:g} m half width, named by its largest speed, each from rest to rest:"
            " whole flights over MAVLink with the bundled PX4-like vehicle, in lockstep. Its rate"
            " loop responds as measured on PX4. It has 1 s⁻¹ of drag and its usual noise. Its"
            f" position arrives at {POSITION_RATE_HZ:g} Hz, 10 ms old, with 1 cm of noise. The"
            " companion uses configs/mock-px4.yaml, with limits of"
            f" {MAX_TILT_DEG:g}° and {MAX_TILT_RATE_DEG_S:g} °/s. The wind is {WINDY:g} m/s from"
            f" north, with gusts of {GUST_SHARE * WINDY:g} m/s (standard deviation, north and"
            " east). Lead (`guidance.lead`) compensates the response of the attitude loop. All"
            " flights have the same seed, so the same noise and the same gusts; with another seed"
            " the differences between planners change by at most 0.2 mm. The error by telemetry is"
            " that of the position that guidance receives, 10 ms late. The vehicle is"
            " in truth 10 ms ahead of this position, so a planner that lags by 10 ms has a smaller"
            " true error."
        ),
        figure=draw_figure(flights),
        caption=CAPTION,
        tables=_tables(flights),
        findings=make_findings(flights),
        series=(_flights_table(flights),),
        rows=_rows(flights),
    )


def _rows(flights: TrackedFlights) -> tuple[dict[str, Any], ...]:
    """The rows that `--json` prints, one for each flight with lead.

    Errors are in m, and null if the flight failed. A row also has the errors of the same flight
    without lead, if that flight was part of the study.
    """
    rows = []
    for task, flight in flights.items():
        if not task.lead:
            continue
        without_lead = flights.get(task._replace(lead=False))
        error_without_lead = (
            PositionError(inf, inf) if without_lead is None else without_lead.telemetry_error
        )
        rows.append(
            {
                "trajectory": task.trajectory.shape,
                "speed_mps": task.trajectory.speed,
                "planner": task.planner,
                "guidance": task.guidance,
                "wind_mps": task.wind,
                "position_rms_m": _or_null(flight.telemetry_error.rms),
                "position_max_m": _or_null(flight.telemetry_error.largest),
                "true_rms_m": _or_null(flight.true_error.rms),
                "true_max_m": _or_null(flight.true_error.largest),
                "not_led_rms_m": _or_null(error_without_lead.rms),
                "not_led_max_m": _or_null(error_without_lead.largest),
                "result": flight.result,
            }
        )
    return tuple(rows)


def _tables(flights: TrackedFlights) -> tuple[Table, ...]:
    """The tables: errors of all planners in still air, and the effects of lead and wind."""
    return (
        _planners_table(
            "track",
            "Position error in still air by telemetry, rms, mm.",
            {task: flight.telemetry_error.rms for task, flight in flights.items()},
        ),
        _planners_table(
            "track-largest",
            "The largest position error of the same flights, mm.",
            {task: flight.telemetry_error.largest for task, flight in flights.items()},
        ),
        _planners_table(
            "track-true",
            "Error of the true position in the same flights, rms, mm.",
            {task: flight.true_error.rms for task, flight in flights.items()},
        ),
        _lead_and_wind_table(flights),
    )


def _flights_table(flights: TrackedFlights) -> Table:
    """Table of every flight."""
    return Table(
        "track-flights",
        "Every flight.",
        tuple(
            {
                "trajectory": task.trajectory.shape,
                "speed, m/s": task.trajectory.speed,
                "planner": task.planner,
                "guidance": task.guidance,
                "wind, m/s": task.wind,
                "lead": "yes" if task.lead else "no",
                "rms, m": _cell(flight.telemetry_error.rms),
                "largest, m": _cell(flight.telemetry_error.largest),
                "true rms, m": _cell(flight.true_error.rms),
                "true largest, m": _cell(flight.true_error.largest),
                "result": flight.result,
            }
            for task, flight in flights.items()
        ),
    )


def _planners_table(name: str, caption: str, errors: dict[Task, float]) -> Table:
    def error(trajectory: TrajectoryAtSpeed, planner: str, guidance: str) -> Cell:
        was_flown = planner in planners(guidance)
        return _in_mm(errors[Task(trajectory, planner, guidance)]) if was_flown else ""

    return Table(
        name,
        caption,
        tuple(
            {
                "trajectory, guidance": f"{trajectory}, {guidance}",
                **{planner: error(trajectory, planner, guidance) for planner in PLANNER_NAMES},
            }
            for guidance in GUIDANCES
            for trajectory in TRAJECTORIES
        ),
    )


def _lead_and_wind_table(flights: TrackedFlights) -> Table:
    def rms(trajectory: TrajectoryAtSpeed, planner: str, wind: float, *, lead: bool = True) -> Cell:
        return _in_mm(flights[Task(trajectory, planner, LINEAR, wind, lead)].telemetry_error.rms)

    return Table(
        "track-lead-and-wind",
        f"Position error by telemetry, rms, mm: in still air and in {WINDY:g} m/s of wind, with"
        " lead (`guidance.lead`) and without. In wind the circle at 7 m/s needs more thrust than"
        " the vehicle has.",
        tuple(
            {
                "trajectory": str(trajectory),
                "still: model-following": rms(trajectory, MODEL_FOLLOWING, CALM),
                "still: without lead": rms(trajectory, MODEL_FOLLOWING, CALM, lead=False),
                "wind: model-following": rms(trajectory, MODEL_FOLLOWING, WINDY),
                "wind: without lead": rms(trajectory, MODEL_FOLLOWING, WINDY, lead=False),
                "wind: first-order": rms(trajectory, FIRST_ORDER, WINDY),
            }
            for trajectory in TRAJECTORIES
        ),
    )


def _in_mm(metres: float) -> Cell:
    return _cell(1e3 * metres)


def _cell(value: float) -> Cell:
    return value if isfinite(value) else _FAILED


def _or_null(value: float) -> float | None:
    return value if isfinite(value) else None
