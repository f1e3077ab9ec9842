"""Commands and measurements, cut into stretches where control paused."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

LONGEST_DEAD_TIME = 0.5
"""Longest dead time that can be found, s."""
_LONGEST_HOLD = 0.5
"""A command is taken as held this long, s; autopilots leave our control after about 1 s."""

_MOST_ROWS = 16_000
"""Most commands and samples of a fit: about half a minute of both at 250 Hz."""
_WINDOW = 10.0
"""Length of the parts of which the most excited are kept, s: some doublets and their answers."""
_LEAD = 1.5
"""Commands kept before a part, s: the longest dead time and ramp."""


class Stretch(NamedTuple):
    """Control without a pause: n commands, each held until the next, and m samples.

    Attributes:
        time: (n,), of the commands, s.
        commanded: (n,).
        measured_time: (m,), s; none is earlier than `LONGEST_DEAD_TIME` after the first command or
            later than the last one, so that its command is known for every dead time.
        measured: (m,), in the commands' unit.
    """

    time: Floats
    commanded: Floats
    measured_time: Floats
    measured: Floats


def stretches(
    time: ArrayLike, commanded: ArrayLike, measured_time: ArrayLike, measured: ArrayLike
) -> list[Stretch]:
    """The stretches of a record that are long enough to hold a sample.

    Args:
        time: (n,), vehicle time of the sample that each command answered, s, in any order.
        commanded: (n,); rows that are not finite are left out.
        measured_time: (m,), vehicle time, s, in any order.
        measured: (m,); rows that are not finite are left out.

    Raises:
        ValueError: a time series and its values are not two rows of equal length.
    """
    t, u = _series(time, commanded)
    sampled, y = _series(measured_time, measured)
    found = []
    for part in np.split(np.arange(t.size), np.flatnonzero(np.diff(t) > _LONGEST_HOLD) + 1):
        if part.size == 0:
            continue
        first, last = t[part[0]], t[part[-1]]
        inside = (sampled >= first + LONGEST_DEAD_TIME) & (sampled <= last)
        if inside.any():
            found.append(Stretch(t[part], u[part], sampled[inside], y[inside]))
    return found


def most_excited(record: list[Stretch]) -> list[Stretch]:
    """A record; of a long one the parts in which the commands changed most.

    Half an hour of flight holds no more information on the response than its most excited minute.
    Each part keeps the commands shortly before it.
    """
    if sum(part.time.size + part.measured_time.size for part in record) <= _MOST_ROWS:
        return record
    windows = [window for part in record for window in _windows(part)]
    windows.sort(key=lambda window: float(np.std(window.commanded)), reverse=True)
    kept: list[Stretch] = []
    rows = 0
    for window in windows:
        rows += window.time.size + window.measured_time.size
        if kept and rows > _MOST_ROWS:
            break
        kept.append(window)
    return sorted(kept, key=lambda window: float(window.time[0]))


def _windows(part: Stretch) -> list[Stretch]:
    """A stretch cut into windows; those without a sample are left out."""
    windows = []
    for start in np.arange(part.measured_time[0], part.measured_time[-1], _WINDOW):
        first, last = np.searchsorted(part.measured_time, (start, start + _WINDOW))
        begin, end = np.searchsorted(part.time, (start - _LEAD, start + _WINDOW))
        begin = max(int(begin) - 1, 0)
        if last > first:
            commands = part.time[begin:end], part.commanded[begin:end]
            measured = part.measured_time[first:last], part.measured[first:last]
            windows.append(Stretch(*commands, *measured))
    return windows


def _series(time: ArrayLike, values: ArrayLike) -> tuple[Floats, Floats]:
    t, v = np.asarray(time, dtype=np.float64), np.asarray(values, dtype=np.float64)
    if t.ndim != 1 or t.shape != v.shape:
        raise ValueError(f"times {t.shape} and values {v.shape} must be two rows of equal length")
    finite = np.isfinite(t) & np.isfinite(v)
    t, v = t[finite], v[finite]
    order = np.argsort(t, kind="stable")
    return t[order], v[order]
