"""The delay between commands and measurements, by their cross-correlation.

Both are filtered to the frequency where a first-order lag describes a real rate loop best. In slow
turns the autopilot's rate integrator compensates the lag: PX4 answers a circle's 1 rad/s after
40 ms, and steps after 87 ms. In fast turns its second order shows.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from companion.identification.lags import held, lagged, slewed, value_at
from companion.identification.record import LONGEST_DEAD_TIME, Stretch, stretches

Floats = NDArray[np.float64]

_GRID = 0.004
"""Period of the samples that are correlated, s."""
_DELAYS = int(LONGEST_DEAD_TIME / _GRID)
_PHASE = 0.38
"""They are compared at the frequency where the lag's phase is about this, rad, clamped to"""
_FREQUENCIES = 5.0, 9.0
"""these two, rad/s. Measured on PX4 (8 rad/s) and ArduPilot (9 rad/s): there the dead times of
steps, circles, figure-eights and doublets agree within 3 ms."""
_RESEMBLING = 0.63
"""First-order lag nearest to PX4's second-order lag, as a share of that."""
_REACH = 3.5
"""Half width of the filter, in its standard deviations."""
_ALIKE = 0.985
"""Share of the movement (R²) that the commands must explain: gusts or the motion of another axis
would distort the delay."""
_EXCITED = 0.005
"""Smallest root mean square of the filtered commands, rad/s."""


def dead_time_by_correlation(
    time: ArrayLike,
    commanded: ArrayLike,
    measured_time: ArrayLike,
    measured: ArrayLike,
    lag: float = 0.0,
    slew: float | None = None,
    damping: float = np.inf,
) -> float | None:
    """The delay at which the movements of commands and measurements correlate most.

    The commands are passed through the known lag first, so that what remains is the dead time.
    With a lag of 0 it is the delay as a whole: the dead time and nearly all of a short lag.

    Args:
        time: (n,), vehicle time of the sample that each command answered, s.
        commanded: (n,), body rates of one axis, rad/s; rows that are not finite are left out.
        measured_time: (m,), vehicle time, s; need not be regular.
        measured: (m,), body rates, rad/s; rows that are not finite are left out.
        lag: of the rate loop, s.
        slew: its slew limit, rad/s², if it has one.
        damping: ζ of a lag of second order, which is `lag` = 2ζ/ω late; infinite in first order.

    Returns:
        s, at most 0.5; None where the commands changed too little, or explain too little of
        the movement.

    Raises:
        ValueError: a time series and its values are not two rows of equal length, or the lag is
            negative or not finite, or the slew is not positive.
    """
    if not 0.0 <= lag < np.inf:
        raise ValueError(f"lag must be finite and not negative, not {lag}")
    if slew is not None and not slew > 0.0:
        raise ValueError(f"slew must be positive, not {slew}")
    products, powers, squares, count = np.zeros(_DELAYS + 1), np.zeros(_DELAYS + 1), 0.0, 0
    band = _band_pass(lag, damping)
    for part in stretches(time, commanded, measured_time, measured):
        movements = _movements(part, lag, slew, band)
        if movements is None:
            continue
        asked, answered = movements
        products += np.correlate(asked, answered, "valid")[::-1]
        powers += np.correlate(asked**2, np.ones(answered.size), "valid")[::-1]
        squares += float(answered @ answered)
        count += answered.size
    if count == 0 or powers.max() < count * _EXCITED**2 or squares == 0.0:
        return None
    found = _peak(products / np.sqrt(np.maximum(powers, count * _EXCITED**2) * squares))
    return None if found is None else max(0.0, found - _later(lag, damping))


def _frequency(lag: float, damping: float) -> float:
    """Centre frequency of the filter, rad/s."""
    slowest, quickest = _FREQUENCIES
    if damping < np.inf:
        lag *= _RESEMBLING
    return min(max(_PHASE / max(lag, _GRID), slowest), quickest)


def _later(lag: float, damping: float) -> float:
    """Delay of a second-order lag beyond that of a first-order one, s."""
    frequency = _frequency(lag, damping)
    turned = frequency * lag
    phase = np.arctan2(turned, 1.0 - (0.5 * turned / damping) ** 2)
    return float(phase - np.arctan(turned)) / frequency


def _band_pass(lag: float, damping: float) -> Floats:
    """(k,), a filter without phase for samples on the grid: a Gaussian's third derivative.

    Its gain ∝ ω³·exp(−1.5·(ω/ω₀)²) has a maximum of 1 and nearly suppresses slow turns.
    """
    frequency = _frequency(lag, damping)
    deviation = 3.0**0.5 / frequency
    half = int(_REACH * deviation / _GRID)
    time = _GRID * np.arange(-half, half + 1)
    at = time / deviation
    shape = at * (3.0 - at**2) * np.exp(-0.5 * at**2)
    taps: Floats = shape / abs(float(np.sin(frequency * time) @ shape))
    return taps


def _movements(
    part: Stretch, lag: float, slew: float | None, band: Floats
) -> tuple[Floats, Floats] | None:
    """(n + delays,) and (n,) movements of commands and measurements on one grid, ends aligned."""
    first, last = part.measured_time[0], part.measured_time[-1]
    answers = int((last - first) / _GRID)
    if answers <= band.size:
        return None
    at = last - _GRID * np.arange(answers + _DELAYS)[::-1]
    at = np.maximum(at, part.time[0])
    knots = held(part.time, part.commanded)
    if slew is not None:
        knots = slewed(knots, slew)
    asked = lagged(knots, lag, at) if lag > 0.0 else value_at(knots, at)
    answered = np.interp(at[_DELAYS:], part.measured_time, part.measured)
    return np.convolve(asked, band, "valid"), np.convolve(answered, band, "valid")


def _peak(alike: Floats) -> float | None:
    """Delay of the largest correlation, s, between the grid's points by a parabola."""
    top = int(np.argmax(alike))
    if alike[top] < _ALIKE**0.5 or top in {0, alike.size - 1}:
        return None
    before, here, after = alike[top - 1 : top + 2].tolist()
    bend = before - 2.0 * here + after
    return _GRID * (top + (0.5 * (before - after) / bend if bend < 0.0 else 0.0))
