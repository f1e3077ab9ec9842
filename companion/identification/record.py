"""Commands and measurements, divided into segments at pauses of control."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from companion.least_squares import Floats

LONGEST_DEAD_TIME = 0.5
"""Longest dead time that can be found, s."""
_LONGEST_HOLD = 0.5
"""Longest time between two commands of a segment, s. Autopilots react to missing setpoints only
later: by default PX4 after 1 s, ArduPilot after 3 s."""

_MOST_ROWS = 16_000
"""Largest number of commands plus samples in a fit: half a minute of both at 250 Hz."""
_WINDOW_DURATION = 10.0
"""A long record is cut into windows of this length, s; the fit uses those with the most
excitation."""
_WINDOW_LEAD = 1.5
"""Commands in this time before a window are kept too, s. The time is longer than the longest dead
time plus the longest slew-limited change of command in the search."""


class Segment(NamedTuple):
    """A part of a record without a pause: n commands, each held until the next, and m samples."""

    time: Floats
    """(n,), times of the commands, s."""
    commanded: Floats
    """(n,), the commands."""
    measured_time: Floats
    """(m,), times of the samples, s, from `LONGEST_DEAD_TIME` after the first command to the last
    command. For every dead time, the command one dead time before a sample is therefore known."""
    measured: Floats
    """(m,), the samples, in the unit of the commands."""


def segments(
    time: ArrayLike, commanded: ArrayLike, measured_time: ArrayLike, measured: ArrayLike
) -> list[Segment]:
    """The segments of a record that contain at least one sample.

    Args:
        time: (n,), vehicle time of the sample to which each command responds, s, in any order.
        commanded: (n,), commands; rows that are not finite are left out.
        measured_time: (m,), vehicle time of the samples, s, in any order.
        measured: (m,), samples; rows that are not finite are left out.

    Raises:
        ValueError: a time series and its values are not one-dimensional and equally long.
    """
    t, u = _checked_series(time, commanded)
    sample_times, y = _checked_series(measured_time, measured)
    found_segments = []
    for rows in np.split(np.arange(t.size), np.flatnonzero(np.diff(t) > _LONGEST_HOLD) + 1):
        if rows.size == 0:
            continue
        first_time, last_time = t[rows[0]], t[rows[-1]]
        is_inside = (sample_times >= first_time + LONGEST_DEAD_TIME) & (sample_times <= last_time)
        if is_inside.any():
            found_segments.append(Segment(t[rows], u[rows], sample_times[is_inside], y[is_inside]))
    return found_segments


def most_excited_windows(record: list[Segment]) -> list[Segment]:
    """The record or, if it is long, only the windows in which the commands varied most.

    Half an hour of flight contains hardly more information on the response than its most excited
    half minute. Each window also contains the commands from the `_WINDOW_LEAD` before the window.
    """
    if sum(segment.time.size + segment.measured_time.size for segment in record) <= _MOST_ROWS:
        return record
    windows = [window for segment in record for window in _windows(segment)]
    windows.sort(key=lambda window: float(np.std(window.commanded)), reverse=True)
    chosen_windows: list[Segment] = []
    row_count = 0
    for window in windows:
        row_count += window.time.size + window.measured_time.size
        if chosen_windows and row_count > _MOST_ROWS:
            break
        chosen_windows.append(window)
    return sorted(chosen_windows, key=lambda window: float(window.time[0]))


def _windows(segment: Segment) -> list[Segment]:
    """A segment divided into windows; those without a sample are left out."""
    windows = []
    for start in np.arange(segment.measured_time[0], segment.measured_time[-1], _WINDOW_DURATION):
        end = start + _WINDOW_DURATION
        samples = slice(*np.searchsorted(segment.measured_time, (start, end)))
        first_command, end_command = np.searchsorted(segment.time, (start - _WINDOW_LEAD, end))
        commands = slice(max(int(first_command) - 1, 0), end_command)
        if segment.measured_time[samples].size:
            commanded = segment.time[commands], segment.commanded[commands]
            measured = segment.measured_time[samples], segment.measured[samples]
            windows.append(Segment(*commanded, *measured))
    return windows


def _checked_series(time: ArrayLike, values: ArrayLike) -> tuple[Floats, Floats]:
    """Check two series, and return times and values in order of time, without non-finite rows.

    Raises:
        ValueError: times and values are not one-dimensional and equally long.
    """
    t, v = np.asarray(time, dtype=np.float64), np.asarray(values, dtype=np.float64)
    if t.ndim != 1 or t.shape != v.shape:
        raise ValueError(
            f"times {t.shape} and values {v.shape} must be one-dimensional and equally long"
        )
    is_finite = np.isfinite(t) & np.isfinite(v)
    t, v = t[is_finite], v[is_finite]
    order = np.argsort(t, kind="stable")
    return t[order], v[order]
