"""The delay between commands and measurements, by where their changes resemble each other most."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from companion.identification.first_order_lag import held, lagged, slewed, value_at
from companion.identification.record import LONGEST_DEAD_TIME, Stretch, stretches

Floats = NDArray[np.float64]

_GRID = 0.004
"""Spacing of the samples that are compared, s."""
_CHANGE = 8
"""A change is taken over so many of them: noise hides what happens in 4 ms, not in 32 ms."""
_DELAYS = int(LONGEST_DEAD_TIME / _GRID)
_ALIKE = 0.5
"""Correlation coefficient below which the changes of the two do not belong together."""
_EXCITED = 0.005
"""Root mean square of the changes below which there is nothing to compare, rad/s."""


def dead_time_by_correlation(
    time: ArrayLike,
    commanded: ArrayLike,
    measured_time: ArrayLike,
    measured: ArrayLike,
    lag: float = 0.0,
    slew: float | None = None,
) -> float | None:
    """The delay at which the changes of commands and measurements correlate most.

    The commands are passed through the known lag first, so that what remains is the dead time.
    With a lag of 0 it is the delay as a whole: the dead time and a part of the lag, all of it where
    commands change slowly against the lag and none where they step.

    Args:
        time: (n,), vehicle time of the sample that each command answered, s.
        commanded: (n,), body rates of one axis, rad/s; rows that are not finite are left out.
        measured_time: (m,), vehicle time, s; need not be regular.
        measured: (m,), body rates, rad/s; rows that are not finite are left out.
        lag: of the rate loop, s.
        slew: its slew limit, rad/s², if it has one.

    Returns:
        s, at most 0.5; None where the commands changed too little or the rates did not follow them.

    Raises:
        ValueError: a time series and its values are not two rows of equal length, or the lag is
            negative or not finite, or the slew is not positive.
    """
    if not 0.0 <= lag < np.inf:
        raise ValueError(f"lag must be finite and not negative, not {lag}")
    if slew is not None and not slew > 0.0:
        raise ValueError(f"slew must be positive, not {slew}")
    products, powers, squares, count = np.zeros(_DELAYS + 1), np.zeros(_DELAYS + 1), 0.0, 0
    for part in stretches(time, commanded, measured_time, measured):
        changes = _changes(part, lag, slew)
        if changes is None:
            continue
        asked, answered = changes
        products += np.correlate(asked, answered, "valid")[::-1]
        powers += np.correlate(asked**2, np.ones(answered.size), "valid")[::-1]
        squares += float(answered @ answered)
        count += answered.size
    if count == 0 or powers.max() < count * _EXCITED**2 or squares == 0.0:
        return None
    return _peak(products / np.sqrt(np.maximum(powers, count * _EXCITED**2) * squares))


def _changes(part: Stretch, lag: float, slew: float | None) -> tuple[Floats, Floats] | None:
    """(n + delays,) and (n,) changes of commands and measurements on one grid, ends aligned."""
    first, last = part.measured_time[0], part.measured_time[-1]
    answers = int((last - first) / _GRID)
    if answers <= _CHANGE:
        return None
    at = last - _GRID * np.arange(answers + _DELAYS)[::-1]
    at = np.maximum(at, part.time[0])
    knots = held(part.time, part.commanded)
    if slew is not None:
        knots = slewed(knots, slew)
    asked = lagged(knots, lag, at) if lag > 0.0 else value_at(knots, at)
    answered = np.interp(at[_DELAYS:], part.measured_time, part.measured)
    return asked[_CHANGE:] - asked[:-_CHANGE], answered[_CHANGE:] - answered[:-_CHANGE]


def _peak(alike: Floats) -> float | None:
    """Delay of the largest correlation, s, between the grid's points by a parabola."""
    top = int(np.argmax(alike))
    if alike[top] < _ALIKE or top in {0, alike.size - 1}:
        return None
    before, here, after = alike[top - 1 : top + 2].tolist()
    bend = before - 2.0 * here + after
    return _GRID * (top + (0.5 * (before - after) / bend if bend < 0.0 else 0.0))
