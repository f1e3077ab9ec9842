"""Detects whether a vehicle swings: an oscillation of roll and pitch with a short period.

Body rates are integrated to angles. The moving mean is subtracted, because wind and slow
corrections are not a swing. The autocorrelation of the remaining fast motion is high if the motion
is periodic. In hovers of 3 to 8 s of the mock vehicles, gusts of 1 to 2 m/s gave an autocorrelation
of at most 0.71, mostly less than 0.4. Gains of the position hold 2.5 times too large gave 0.8 to 1.
"""

from math import nan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class _MeasuringRule(NamedTuple):
    """The criteria of a swing."""

    shortest_part: float
    """Shortest part of a flight that is judged, s."""
    window: float
    """Length of the moving mean, s; slower motion does not count."""
    passes: int
    """Number of times that the moving mean is removed."""
    longest_period: float
    """Longest period of a swing, s."""


_LONG_HOVER, _SHORT_HOVER = _MeasuringRule(5.0, 2.0, 1, 2.5), _MeasuringRule(2.9, 1.0, 1, 1.25)
_IN_MOTION = _MeasuringRule(4.0, 1.0, 2, 1.25)
SHORTEST_PART = _SHORT_HOVER.shortest_part
"""Shortest part of a flight in which a swing can be measured, s."""
_LONGEST_SAMPLE_PERIOD = 0.05
"""Longest time between samples from which a swing is measured, s."""
_PEAK_SHARE = 0.9
"""The first peak of at least this share of the highest one gives the period, because multiples of
the period also have peaks."""


class Swing(NamedTuple):
    """Oscillation of roll and pitch; NaN: not measured."""

    rms: float = nan
    """RMS of roll and pitch together, without slow motion, rad."""
    period: float = nan
    """Period of the oscillation, s; NaN also if nothing repeats."""
    regularity: float = nan
    """Autocorrelation at `period`: 1 repeats exactly, 0 not at all."""


NOT_MEASURED = Swing()


def measure_swing(time: Floats, rates: Floats, *, at_rest: bool) -> Swing:
    """Measure the oscillation in a part of a flight.

    Args:
        time: (N,) vehicle time, s.
        rates: (N, 2) measured roll and pitch rate, rad/s.
        at_rest: whether the reference is at rest; slower motion then also counts as a swing.
    """
    duration = float(time[-1] - time[0]) if len(time) > 1 else 0.0
    hover = _LONG_HOVER if duration >= _LONG_HOVER.shortest_part else _SHORT_HOVER
    rule = hover if at_rest else _IN_MOTION
    if duration < rule.shortest_part:
        return NOT_MEASURED
    sample_period = float(np.median(np.diff(time)))
    expected_count = duration / sample_period if sample_period > 0.0 else np.inf
    # Too few samples, or their clock jumped.
    if sample_period > _LONGEST_SAMPLE_PERIOD or expected_count > 2 * len(time):
        return NOT_MEASURED
    even_times = np.arange(time[0], time[-1], sample_period)
    angle_steps = (
        np.column_stack([np.interp(even_times, time, column) for column in rates.T]) * sample_period
    )
    angles = np.cumsum(angle_steps, axis=0)
    for _ in range(rule.passes):
        angles = _without_slow_motion(angles, round(0.5 * rule.window / sample_period))
    rms = float(np.sqrt(np.mean(np.sum(angles**2, axis=1))))
    if rms == 0.0:
        return Swing(0.0, nan, 0.0)
    correlation = _autocorrelation(angles)[: round(rule.longest_period / sample_period)]
    negative_lags = np.flatnonzero(correlation < 0.0)
    later_correlation = correlation[negative_lags[0] :] if len(negative_lags) else correlation[:0]
    if not later_correlation.max(initial=-1.0) > 0.0:
        return Swing(rms, nan, 0.0)
    peaks = np.flatnonzero(later_correlation >= _PEAK_SHARE * later_correlation.max())
    # From the first point that is high enough, up to the top of its own peak.
    peak = int(peaks[0])
    while (
        peak + 1 < len(later_correlation) and later_correlation[peak + 1] > later_correlation[peak]
    ):
        peak += 1
    return Swing(
        rms, (int(negative_lags[0]) + peak) * sample_period, float(later_correlation[peak])
    )


def _without_slow_motion(angles: Floats, half_width: int) -> Floats:
    """Angles (N, 2) less their moving mean over `2 half_width + 1` steps: (N − 2 half_width, 2)."""
    width = 2 * half_width + 1
    cumulative_sums = np.cumsum(np.vstack([np.zeros((1, 2)), angles]), axis=0)
    fast_motion: Floats = (
        angles[half_width : len(angles) - half_width]
        - (cumulative_sums[width:] - cumulative_sums[:-width]) / width
    )
    return fast_motion


def _autocorrelation(angles: Floats) -> Floats:
    """Autocorrelation (N,) of both angles (N, 2) together, by lag in rows: 1 at lag 0.

    The estimate is unbiased: each lag is divided by the number of rows that overlap.
    """
    count = len(angles)
    spectrum = np.fft.rfft(angles - angles.mean(axis=0), 2 * count, axis=0)
    products = np.fft.irfft((np.abs(spectrum) ** 2).sum(axis=1))[:count]
    unbiased: Floats = products / products[0] * count / (count - np.arange(count))
    return unbiased
