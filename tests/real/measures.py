"""What a flight on a simulator is measured by: against the truth, and against telemetry.

Frames: the estimator's origin, north and down are its own, so the truth is first laid over the
estimate by one constant shift and one constant turn about the vertical for the whole flight. What
the estimator wanders by within a flight counts as error.

Clocks: reference, telemetry and truth are stamped by the vehicle's own clock. The program stamps
its reference by its estimate of that clock; a lateness of that is seen in `late_ms`.
"""

from math import atan2, degrees

import numpy as np

from companion.attitude import coefficients, heading
from companion.recording.measurements.response import measure_response
from tests.real.truth import (
    Floats,
    Truth,
    conjugated,
    continuous,
    multiplied,
    require_cover,
    turned,
)

_NEAR = 0.01
"""A true attitude without a sample of telemetry so near to it says nothing of a step, s."""
_DENSE = 0.012
"""Attitudes nearer together than this are interpolated themselves, s."""
_MOVING = 0.05
"""A reference that moves faster is a maneuver, m/s."""
_PAUSE = 0.5
"""Maneuvers are at least so far apart, s."""
_FULL_SPEED = 0.99
"""Steady state is between the first and the last time at this share of the largest speed."""
_SETTLING = 1.0
"""This much of it is left out at its beginning, s."""
_SETTLING_HOVER = 2.0
"""This much is left out of a hover, s."""
_SHORTEST = 1.0
"""A part that lasts less is not measured, s."""


def straightness(
    response: Floats, estimated: Floats, truth: Truth | None, gain: float, resting: Floats
) -> dict[str, float] | None:
    """Cross-axis of the steps by telemetry and by truth; None where none was flown.

    Args:
        response: (n, 7), rows of `FlightTrace.response`, whose attitudes leave out what the
            estimator corrected of its heading during the steps.
        estimated: (n, 4), the attitudes at those times as telemetry told them.
        truth: of that flight, or None where there is none to be had.
        gain: p, 1/s.
        resting: (2,), coefficients that the program added to those of the steps: by its estimate
            they hold the vehicle at rest, so in the world the targets are without them.
    """
    rows = response.copy()
    rows[:, 1:5] = estimated
    told = measure_response(rows, gain)
    if told is None:
        return None
    if truth is None:
        return {"telemetry": told.cross_axis_max}
    q = true_attitudes(response, truth)
    turn = mean_angle(_headings_apart(response[:, 1:5], q))
    wander = np.unwrap(_headings_apart(estimated, q))
    rows[:, 1:5] = turned(q, turn)
    rows[:, 5:7] -= resting
    true = measure_response(rows, gain)
    assert true is not None
    return {
        "telemetry": told.cross_axis_max,
        "truth": true.cross_axis_max,
        "heading_deg": degrees(heading(tuple(response[0, 1:5]))),
        "heading_off_deg": degrees(turn),
        "heading_wander_deg": degrees(float(np.ptp(wander))),
        "attitude_late_ms": 1e3 * attitude_lateness(response, truth),
    }


def resting(response: Floats) -> Floats:
    """(2,), the coefficients that were added to those of a whole maneuver of steps.

    The steps of a maneuver cancel each other, so this is the mean of its targets.
    """
    return np.unique(response[:, 5:7].round(9), axis=0).mean(axis=0)


def _headings_apart(left: Floats, right: Floats) -> list[float]:
    """Differences of the headings of attitudes, row by row, rad."""
    return [heading(tuple(a)) - heading(tuple(b)) for a, b in zip(left, right, strict=True)]


def true_attitudes(response: Floats, truth: Truth) -> Floats:
    """(n, 4), the true attitudes at the times of the samples.

    The truth may be sampled more rarely than telemetry (ArduPilot: 25 Hz). The estimate's error is
    then interpolated, which changes slowly, and not the attitude, which turns by 400°/s.

    Raises:
        NoTruthError: there are holes in it.
    """
    time, told = response[:, 0], response[:, 1:5]
    require_cover(truth.q_time, time)
    at, true = _among(truth, time)
    if np.median(np.diff(at)) < _DENSE:
        return _interpolated(time, at, true)
    error = continuous(multiplied(true, conjugated(_interpolated(at, time, told))))
    return multiplied(_interpolated(time, at, error), told)


def _among(truth: Truth, time: Floats) -> tuple[Floats, Floats]:
    """Those true attitudes that have a sample of telemetry near them."""
    after = np.clip(np.searchsorted(time, truth.q_time), 1, len(time) - 1)
    off = np.minimum(np.abs(time[after] - truth.q_time), np.abs(time[after - 1] - truth.q_time))
    return truth.q_time[off < _NEAR], truth.q[off < _NEAR]


def _interpolated(at: Floats, time: Floats, q: Floats) -> Floats:
    parts = np.column_stack([np.interp(at, time, part) for part in continuous(q).T])
    return parts / np.linalg.norm(parts, axis=1, keepdims=True)


def attitude_lateness(response: Floats, truth: Truth) -> float:
    """By how much the estimate's attitude is behind the truth, s, by overlaying the tilts.

    It tells how well the two clocks are aligned: an estimator's attitude is hardly late.
    """
    at, true = _among(truth, response[:, 0])

    def tilts(q: Floats) -> Floats:
        return np.array([coefficients(tuple(row)) for row in q])

    return -lateness(at, tilts(true), lambda when: tilts(_interpolated(when, *_estimate(response))))


def _estimate(response: Floats) -> tuple[Floats, Floats]:
    return response[:, 0], response[:, 1:5]


def lateness(time: Floats, told: Floats, true_at, step: float = 0.005) -> float:
    """The shift s of `true_at(time - s)` that comes nearest to `told`, s (one Gauss-Newton step).

    Constant differences between the two are left out.
    """
    late = 0.0
    for _ in range(4):
        true = true_at(time - late)
        slope = (true_at(time - late + step) - true_at(time - late - step)) / (2.0 * step)
        off = told - true
        off, slope = off - off.mean(axis=0), slope - slope.mean(axis=0)
        late -= float(np.sum(off * slope) / max(np.sum(slope * slope), 1e-12))
        late = float(np.clip(late, -0.08, 0.08))
    return late


def maneuvers(tracking: Floats) -> tuple[list[slice], list[slice]]:
    """The steady parts of the moving maneuvers, and the calm parts, of `FlightTrace.tracking`."""
    time, reference = tracking[:, 0], tracking[:, 1:4]
    velocity = np.gradient(reference, time, axis=0)
    speed = np.linalg.norm(velocity, axis=1)  # NaN where the reference is open-loop
    closed = ~np.isnan(reference[:, 0])
    moving = closed & (speed > _MOVING)
    parts = [_steady(time, speed, part) for part in _runs(moving, time) if _lasts(time, part)]
    calm = [
        _without_beginning(time, part, _SETTLING_HOVER)
        for part in _runs(closed & (speed <= _MOVING), time, pause=0.0)
    ]
    return [part for part in parts if _lasts(time, part)], [p for p in calm if _lasts(time, p)]


def tracking_errors(
    tracking: Floats, positions: Floats, truth: Truth | None
) -> dict[str, list[dict]]:
    """Per maneuver, errors by the program's estimate, by telemetry and by truth, m.

    Args:
        tracking: (n, 7), rows of `FlightTrace.tracking`.
        positions: (m, 4), vehicle time s, north, east, down m, as telemetry told them.
        truth: of that flight, or None where there is none to be had.
    """
    inside = (tracking[:, 0] > positions[0, 0]) & (tracking[:, 0] < positions[-1, 0])
    tracking = tracking[inside]
    time = tracking[:, 0]
    told = np.column_stack([np.interp(time, positions[:, 0], axis) for axis in positions[:, 1:].T])
    seen = {"program": tracking[:, 4:7], "telemetry": told}
    if truth is not None:
        true = truth.position_at(time)
        seen["truth"] = true + (told - true).mean(axis=0)
    moving, calm = maneuvers(tracking)
    return {
        name: [_part_errors(tracking, seen, part) for part in parts]
        for name, parts in (("moving", moving), ("hover", calm))
    }


def _part_errors(tracking: Floats, seen: dict[str, Floats], part: slice) -> dict:
    time, reference = tracking[part, 0], tracking[part, 1:4]
    velocity = np.gradient(reference, time, axis=0)
    errors = {name: split_error(at[part] - reference, velocity) for name, at in seen.items()}
    if "truth" in seen:
        errors["estimator"] = split_error(seen["telemetry"][part] - seen["truth"][part], velocity)
    return {
        "seconds": round(float(time[-1] - time[0]), 1),
        "speed": round(float(np.linalg.norm(velocity, axis=1).max()), 2),
        **errors,
    }


def split_error(error: Floats, velocity: Floats) -> dict[str, float]:
    """RMS in m: all of it, along the path, across it (level), in height; and how late, ms."""
    level = velocity[:, :2]
    speed = np.hypot(*level.T)
    out = {"rms": rms(error), "height": rms(error[:, 2]), "level": rms(error[:, :2])}
    if float(speed.max()) > _MOVING:
        unit = level / np.maximum(speed, 1e-6)[:, None]
        along = np.sum(error[:, :2] * unit, axis=1)
        out["along"] = rms(along)
        out["across"] = rms(error[:, 0] * -unit[:, 1] + error[:, 1] * unit[:, 0])
        out["late_ms"] = -1e3 * float(np.sum(along * speed) / np.sum(speed * speed))
    return {name: round(value, 4) for name, value in out.items()}


def rms(error: Floats) -> float:
    """Of the lengths of the rows, or of numbers."""
    squares = error**2 if error.ndim == 1 else np.sum(error**2, axis=1)
    return float(np.sqrt(np.mean(squares)))


def mean_angle(angles) -> float:
    """Mean direction, rad."""
    return atan2(float(np.mean(np.sin(angles))), float(np.mean(np.cos(angles))))


def _runs(chosen, time: Floats, pause: float = _PAUSE) -> list[slice]:
    """Where `chosen` holds without a longer break than `pause`."""
    index = np.flatnonzero(chosen)
    if len(index) == 0:
        return []
    apart = np.diff(time[index]) > pause if pause else np.diff(index) > 1
    return [slice(part[0], part[-1] + 1) for part in np.split(index, np.flatnonzero(apart) + 1)]


def _steady(time: Floats, speed: Floats, part: slice) -> slice:
    fast = np.flatnonzero(speed[part] >= _FULL_SPEED * speed[part].max()) + part.start
    return _without_beginning(time, slice(fast[0], fast[-1] + 1), _SETTLING)


def _without_beginning(time: Floats, part: slice, seconds: float) -> slice:
    return slice(int(np.searchsorted(time, time[part.start] + seconds)), part.stop)


def _lasts(time: Floats, part: slice) -> bool:
    return part.stop - part.start > 2 and bool(time[part.stop - 1] - time[part.start] > _SHORTEST)
