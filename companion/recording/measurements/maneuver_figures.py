"""Tracking figures of each maneuver; errors of different maneuvers cannot be compared."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import degrees, inf, isnan, nan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from companion.recording.measurements.swing import NOT_MEASURED, SHORTEST_PART, Swing, measure_swing
from companion.recording.trace import ManeuverChange

Floats = NDArray[np.float64]

SETTLING_TIME = 2.0
"""Time left out at the beginning of a maneuver, s: the previous one still has an effect then."""
_MAX_SETTLING_SHARE = 0.25
"""Largest share of a maneuver's duration that is left out at its beginning."""
_MAX_SPEED_AT_REST = 0.05
"""A reference that is never faster than this is at rest, m/s."""


@dataclass(frozen=True, slots=True)
class ManeuverFigures:
    """Tracking figures of one maneuver; NaN: not measured.

    Horizontal errors are in the north-east plane. In open loop there is no reference position:
    `horizontal_rms` and `horizontal_max` are NaN, and `drift` says how far the vehicle moved away.
    """

    name: str
    begin: float
    """Beginning of the maneuver, s since the flight began."""
    duration: float
    """Duration of the maneuver, s."""
    open_loop: bool
    """Whether a part of the maneuver is open loop."""
    settling_time: float
    """Time at the beginning of the maneuver that RMS and largest errors leave out, s."""
    horizontal_rms: float
    """RMS of the horizontal error, m."""
    horizontal_max: float
    """Largest horizontal error, m."""
    height_rms: float
    """RMS of the height error, m."""
    height_max: float
    """Largest height error, m."""
    height_mean: float
    """Mean height error, m, positive above the reference."""
    settling_max: float
    """Largest distance from the reference during `settling_time`, m."""
    drift: float
    """Largest horizontal distance from where the maneuver began, m."""
    speed: float
    """Largest speed of the reference (95th percentile), m/s; NaN without a reference."""
    swing: Swing
    """Oscillation of roll and pitch; not measured in open loop."""

    def as_dict(self) -> dict[str, Any]:
        """The figures as JSON; null for values that were not measured."""
        numbers = {
            "begin_s": self.begin,
            "duration_s": self.duration,
            "beginning_left_out_s": self.settling_time,
            "level_rms_m": self.horizontal_rms,
            "level_max_m": self.horizontal_max,
            "height_rms_m": self.height_rms,
            "height_max_m": self.height_max,
            "height_mean_m": self.height_mean,
            "beginning_max_m": self.settling_max,
            "drift_max_m": self.drift,
            "reference_speed_max_m_s": self.speed,
            "swing_rms_deg": degrees(self.swing.rms),
            "swing_period_s": self.swing.period,
            "swing_regularity": self.swing.regularity,
        }
        return {
            "name": self.name,
            "open_loop": self.open_loop,
            **{key: None if isnan(value) else round(value, 4) for key, value in numbers.items()},
        }


def measure_maneuvers(
    rows: Floats, rates: Floats, maneuver_changes: Sequence[ManeuverChange], start_time: float
) -> tuple[ManeuverFigures, ...]:
    """Measure each maneuver that was flown.

    Args:
        rows: (N, 7), rows of `FlightTrace.tracking`.
        rates: (M, 3) vehicle time, s, and measured roll and pitch rate, rad/s.
        maneuver_changes: `FlightTrace.maneuvers`.
        start_time: beginning of the flight, s on our clock.
    """
    return tuple(
        _figures_of(change.name or "", change.time - start_time, part, rates)
        for change, part in _flown_maneuvers(rows, maneuver_changes)
    )


def settled_maneuver_rows(rows: Floats, maneuver_changes: Sequence[ManeuverChange]) -> list[Floats]:
    """The rows of each maneuver in closed loop, without the settling time at its beginning.

    `rows` are the (N, 7) rows of `FlightTrace.tracking`.
    """
    parts = [
        part for _, part in _flown_maneuvers(rows, maneuver_changes) if not _is_open_loop(part)
    ]
    return [part[part[:, 0] >= part[0, 0] + _settling_time(part)] for part in parts]


def in_maneuvers(
    vehicle_times: Floats, maneuver_changes: Sequence[ManeuverChange]
) -> NDArray[np.bool_]:
    """Whether each vehicle time (N,), s, lies in a maneuver; False for NaN."""
    change_times = np.array([change.vehicle_time for change in maneuver_changes])
    maneuver_follows = np.array([False, *(change.name is not None for change in maneuver_changes)])
    is_in_maneuver = maneuver_follows[np.searchsorted(change_times, vehicle_times, side="right")]
    return np.asarray(is_in_maneuver & ~np.isnan(vehicle_times))


def _flown_maneuvers(
    rows: Floats, maneuver_changes: Sequence[ManeuverChange]
) -> Iterator[tuple[ManeuverChange, Floats]]:
    """Each maneuver that was flown, with its rows."""
    end_times = [*(change.vehicle_time for change in maneuver_changes[1:]), inf]
    # Without changes, `end_times` still has one entry.
    for change, end in zip(maneuver_changes, end_times, strict=False):
        part = rows[(rows[:, 0] >= change.vehicle_time) & (rows[:, 0] < end)]
        if change.name is not None and len(part) > 1:
            yield change, part


def _is_open_loop(rows: Floats) -> bool:
    return bool(np.isnan(rows[:, 1]).any())


def _settling_time(rows: Floats) -> float:
    """Time that is left out at the beginning of a maneuver, s."""
    if _is_open_loop(rows):
        return 0.0
    return min(SETTLING_TIME, _MAX_SETTLING_SHARE * float(rows[-1, 0] - rows[0, 0]))


def _swing(rates: Floats, time: Floats, settling_time: float, speed: float) -> Swing:
    """Oscillation of roll and pitch in a maneuver; `speed`: largest reference speed, m/s."""
    begin, end = time[0], time[-1]
    if float(end - begin) - settling_time >= SHORTEST_PART:
        begin += settling_time
    part = rates[(rates[:, 0] >= begin) & (rates[:, 0] <= end)]
    return measure_swing(part[:, 0], part[:, 1:], at_rest=speed <= _MAX_SPEED_AT_REST)


def _figures_of(name: str, begin: float, rows: Floats, rates: Floats) -> ManeuverFigures:
    time, reference, position = rows[:, 0], rows[:, 1:4], rows[:, 4:7]
    duration = float(time[-1] - time[0])
    open_loop, settling_time = _is_open_loop(rows), _settling_time(rows)
    is_settling = time < time[0] + settling_time
    error = position - reference
    horizontal_error, height_error = np.hypot(error[:, 0], error[:, 1]), -error[:, 2]
    height_known = ~np.isnan(height_error)  # another program may command the thrust
    settled_height_error = height_error[~is_settling & height_known]
    offset = position[:, :2] - position[0, :2]
    speed = _largest_speed(time, reference)
    return ManeuverFigures(
        name,
        begin,
        duration,
        open_loop,
        settling_time,
        horizontal_rms=nan if open_loop else rms(horizontal_error[~is_settling]),
        horizontal_max=nan if open_loop else largest(horizontal_error[~is_settling]),
        height_rms=rms(settled_height_error),
        height_max=largest(np.abs(settled_height_error)),
        height_mean=float(settled_height_error.mean()) if len(settled_height_error) else nan,
        settling_max=largest(np.hypot(horizontal_error, height_error)[is_settling & height_known]),
        drift=float(np.hypot(offset[:, 0], offset[:, 1]).max()),
        speed=speed,
        swing=NOT_MEASURED if open_loop else _swing(rates, time, settling_time, speed),
    )


def _largest_speed(time: Floats, reference: Floats) -> float:
    """The largest speed of the reference (95th percentile), m/s; NaN without a reference."""
    durations = np.diff(time)
    distances = np.linalg.norm(np.diff(reference, axis=0), axis=1)
    speeds = distances[durations > 0.0] / durations[durations > 0.0]
    # A percentile, so that one late row does not look like a high speed.
    return float(np.percentile(speeds, 95)) if np.isfinite(speeds).all() and len(speeds) else nan


def largest(values: Floats) -> float:
    """The largest of the values; NaN without values."""
    return float(values.max()) if len(values) else nan


def rms(values: Floats) -> float:
    """The root mean square; NaN without values."""
    return float(np.sqrt(np.mean(values**2))) if len(values) else nan


def without_nan(values: dict[str, float]) -> dict[str, float | None]:
    """The values as JSON; null for NaN."""
    return {key: None if isnan(value) else value for key, value in values.items()}
