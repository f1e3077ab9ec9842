"""The delay between commands and measurements, from their cross-correlation.

Commands and measurements are band-pass filtered to the frequencies at which a first-order lag
describes a real rate loop best. At low frequencies the autopilot's rate integrator compensates the
lag: PX4 follows a circle (1 rad/s) with a delay of 40 ms, but steps with 87 ms. At high frequencies
the loop is second-order.
"""

import numpy as np
from numpy.typing import ArrayLike

from companion.attitude.rate_response import FIRST_ORDER_LAG_SHARE
from companion.identification.lags import (
    first_order_response,
    held_commands,
    slew_limited,
    value_at,
)
from companion.identification.record import LONGEST_DEAD_TIME, Segment, segments
from companion.least_squares import Floats

_GRID_PERIOD = 0.004
"""Sample period of the correlation, s."""
_DELAY_COUNT = int(LONGEST_DEAD_TIME / _GRID_PERIOD)
"""Number of delays that are compared, in addition to 0; they are `_GRID_PERIOD` apart."""
_CENTRE_PHASE = 0.38
"""Phase of the known lag at the centre frequency of the filter, rad."""
_CENTRE_FREQUENCIES = 5.0, 9.0
"""Bounds of the centre frequency, rad/s. At 8 rad/s on PX4 and 9 rad/s on ArduPilot, the dead times
measured in steps, circles, figure-eights and doublets agree within 3 ms."""
_FILTER_HALF_WIDTH = 3.5
"""Half width of the filter's impulse response, in standard deviations of its Gaussian."""
_LEAST_EXPLAINED = 0.985
"""Smallest usable R² of a correlation; with less, gusts or another axis distort the delay."""
_LEAST_EXCITATION = 0.005
"""Smallest RMS of the filtered commands with which a delay is measured, rad/s."""


def dead_time_by_correlation(
    time: ArrayLike,
    commanded: ArrayLike,
    measured_time: ArrayLike,
    measured: ArrayLike,
    lag: float = 0.0,
    slew: float | None = None,
    damping: float = np.inf,
) -> float | None:
    """The dead time: the delay at which filtered commands and measurements correlate most.

    The commands first pass through the known lag, so that the remaining delay is the dead time.
    With a `lag` of 0, the result is the dead time plus most of the lag, if the lag is short.

    Args:
        time: (n,), vehicle time of the sample to which each command responds, s.
        commanded: (n,), body rates of one axis, rad/s; rows that are not finite are left out.
        measured_time: (m,), vehicle time, s; need not be regular.
        measured: (m,), body rates, rad/s; rows that are not finite are left out.
        lag: known lag of the rate loop, s; 2ζ/ω for a second-order lag.
        slew: slew limit of the rate loop, rad/s²; None: no limit.
        damping: ζ of a second-order lag; infinite for a first-order one.

    Returns:
        The delay, s, less than 0.5; None if the record is too short, the commands changed too
            little or explain too little, or the correlation is largest at a delay of 0 or 0.5 s.

    Raises:
        ValueError: a time series and its values are not one-dimensional and equally long, or the
            lag is negative or not finite, or the slew is not positive.
    """
    if not 0.0 <= lag < np.inf:
        raise ValueError(f"lag must be finite and not negative, not {lag}")
    if slew is not None and not slew > 0.0:
        raise ValueError(f"slew must be positive, not {slew}")
    taps = _band_pass(lag, damping)
    record_segments = segments(time, commanded, measured_time, measured)
    filtered_pairs = [
        filtered_pair
        for segment in record_segments
        if (filtered_pair := _filter(segment, lag, slew, taps)) is not None
    ]
    correlation = _correlation(filtered_pairs)
    delay = None if correlation is None else _peak_delay(correlation)
    return None if delay is None else max(0.0, delay - _second_order_delay(lag, damping))


def _correlation(pairs: list[tuple[Floats, Floats]]) -> Floats | None:
    """(`_DELAY_COUNT` + 1,), correlation of filtered commands and measurements at each delay.

    None: there are no pairs, or the commands or the measurements hardly changed.
    """
    products, command_energy = np.zeros(_DELAY_COUNT + 1), np.zeros(_DELAY_COUNT + 1)
    response_energy, count = 0.0, 0
    for commands, response in pairs:
        products += np.correlate(commands, response, "valid")[::-1]
        command_energy += np.correlate(commands**2, np.ones(response.size), "valid")[::-1]
        response_energy += float(response @ response)
        count += response.size
    least_energy = count * _LEAST_EXCITATION**2
    if count == 0 or command_energy.max() < least_energy or response_energy == 0.0:
        return None
    return products / np.sqrt(np.maximum(command_energy, least_energy) * response_energy)


def _centre_frequency(lag: float, damping: float) -> float:
    """Centre frequency of the filter, rad/s."""
    lowest, highest = _CENTRE_FREQUENCIES
    if damping < np.inf:
        lag *= FIRST_ORDER_LAG_SHARE
    return min(max(_CENTRE_PHASE / max(lag, _GRID_PERIOD), lowest), highest)


def _second_order_delay(lag: float, damping: float) -> float:
    """Delay of the second-order lag minus that of a first-order one, at the centre frequency, s."""
    frequency = _centre_frequency(lag, damping)
    lag_phase = frequency * lag
    phase = np.arctan2(lag_phase, 1.0 - (0.5 * lag_phase / damping) ** 2)
    return float(phase - np.arctan(lag_phase)) / frequency


def _band_pass(lag: float, damping: float) -> Floats:
    """(k,), taps of a band-pass filter for samples on the grid: third derivative of a Gaussian.

    The gain is proportional to ω³·exp(−1.5·(ω/ω₀)²): 1 at the centre frequency ω₀, its maximum, and
    nearly 0 for slow turns. The filter delays commands and measurements equally.
    """
    frequency = _centre_frequency(lag, damping)
    deviation = 3.0**0.5 / frequency
    half_count = int(_FILTER_HALF_WIDTH * deviation / _GRID_PERIOD)
    time = _GRID_PERIOD * np.arange(-half_count, half_count + 1)
    scaled_time = time / deviation
    shape = scaled_time * (3.0 - scaled_time**2) * np.exp(-0.5 * scaled_time**2)
    taps: Floats = shape / abs(float(np.sin(frequency * time) @ shape))
    return taps


def _filter(
    segment: Segment, lag: float, slew: float | None, taps: Floats
) -> tuple[Floats, Floats] | None:
    """Filtered commands (n + `_DELAY_COUNT`,) and measurements (n,), both sampled on the grid.

    Both arrays end at the same time. None: the measurements are shorter than the filter.
    """
    first_time, last_time = segment.measured_time[0], segment.measured_time[-1]
    count = int((last_time - first_time) / _GRID_PERIOD)
    if count <= taps.size:
        return None
    times = last_time - _GRID_PERIOD * np.arange(count + _DELAY_COUNT)[::-1]
    times = np.maximum(times, segment.time[0])
    knots = held_commands(segment.time, segment.commanded)
    if slew is not None:
        knots = slew_limited(knots, slew)
    commands = first_order_response(knots, lag, times) if lag > 0.0 else value_at(knots, times)
    response = np.interp(times[_DELAY_COUNT:], segment.measured_time, segment.measured)
    return np.convolve(commands, taps, "valid"), np.convolve(response, taps, "valid")


def _peak_delay(correlation: Floats) -> float | None:
    """Delay of the largest correlation, s, interpolated by a parabola.

    None if the largest correlation is too small, or is at the first or last delay.
    """
    peak = int(np.argmax(correlation))
    if correlation[peak] < _LEAST_EXPLAINED**0.5 or peak in {0, correlation.size - 1}:
        return None
    before, at_peak, after = correlation[peak - 1 : peak + 2].tolist()
    curvature = before - 2.0 * at_peak + after
    return _GRID_PERIOD * (peak + (0.5 * (before - after) / curvature if curvature < 0.0 else 0.0))
