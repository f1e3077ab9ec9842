"""Specific thrust over normalised thrust (SET_ATTITUDE_TARGET), fitted to a flight."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from companion.identification.fit import fit_lag
from companion.identification.record import Segment, segments

_LEAST_EXPLAINED = 0.8
"""Smallest R² of a usable map."""
_EXCITED_SHARE = 0.2
"""Smallest deviation of an excited command from the median, as a share of the commands' range."""
_ACCEPTED_HOVER = 0.05, 0.95
"""Range of the normalised thrust at hover that the configuration accepts."""
_LARGEST_DELAY = 0.5
"""Largest sum of lag and dead time of the rotors, s."""


@dataclass(frozen=True, slots=True)
class ThrustMap:
    """Specific thrust T = slope·u + offset, which follows the normalised thrust u with a lag."""

    slope: float
    """Specific thrust per unit of normalised thrust, m/s²."""
    offset: float
    """Specific thrust at u = 0, by extrapolation, m/s²."""
    lag: float
    """Lag of the rotors, s."""
    dead_time: float
    """Time from a sample to the first effect of its command on the thrust, s."""
    explained: float
    """R², share of the variance of the measured thrust that the map explains."""

    def normalised(self, specific_thrust: float) -> float:
        """Normalised thrust, 0..1, that gives a specific thrust (m/s²)."""
        return (specific_thrust - self.offset) / self.slope

    def flaw(self, gravity: float) -> str | None:
        """Reason why the map must not be used; None if it may be used.

        Args:
            gravity: gravity, m/s²; the map must reach it at a normalised thrust from 0.05 to 0.95.
        """
        if not self.explained >= _LEAST_EXPLAINED:
            return f"the map explains only {self.explained:.0%} of the measured thrust"
        if not self.slope > 0.0:
            return "the measured thrust falls when the commanded thrust rises"
        if not self.lag + self.dead_time < _LARGEST_DELAY:
            return (
                f"lag plus dead time of the rotors is {self.lag + self.dead_time:.2f} s; it must "
                f"be less than {_LARGEST_DELAY:.2f} s"
            )
        hover = self.normalised(gravity)
        if not _ACCEPTED_HOVER[0] < hover < _ACCEPTED_HOVER[1]:
            return f"by the map the vehicle hovers at a thrust of {hover:.2f}"
        return None

    def described(self) -> str:
        """Text for the user: the map in one line."""
        return (
            f"T/m = {self.slope:.2f}·u {self.offset:+.2f} m/s² for u in 0..1, lag "
            f"{1e3 * self.lag:.0f} ms, dead time {1e3 * self.dead_time:.0f} ms, explains "
            f"{self.explained:.1%} of the variance"
        )


def _excited_samples(record: list[Segment]) -> list[Segment]:
    """The record without samples of steady thrust, which contain only vibration and gusts.

    A sample stays if it follows an excited command within `_LARGEST_DELAY`.
    """
    if not record:
        return []
    thrust = np.concatenate([segment.commanded for segment in record])
    median, least_change = float(np.median(thrust)), _EXCITED_SHARE * float(np.ptp(thrust))
    excited_segments = []
    for segment in record:
        change_times = segment.time[np.abs(segment.commanded - median) > least_change]
        latest_change = np.searchsorted(change_times, segment.measured_time, side="right")
        elapsed = segment.measured_time - np.concatenate(([-np.inf], change_times))[latest_change]
        is_excited = elapsed < _LARGEST_DELAY
        if is_excited.any():
            measured = segment.measured_time[is_excited], segment.measured[is_excited]
            excited_segments.append(Segment(segment.time, segment.commanded, *measured))
    return excited_segments


def fit_thrust_map(
    time: ArrayLike, thrust: ArrayLike, measured_time: ArrayLike, specific_thrust: ArrayLike
) -> ThrustMap | None:
    """Fit a `ThrustMap`: a straight line with first-order lag and dead time (least squares).

    Thrust doublets of a level, slow vehicle give the best fit. In fast flight, drag along the body
    z axis would be taken for thrust.

    Args:
        time: (n,), vehicle time of the sample to which each command responds, s.
        thrust: (n,), normalised thrust, 0..1; rows that are not finite are left out.
        measured_time: (m,), vehicle time, s; need not be regular.
        specific_thrust: (m,), m/s²: the accelerometer's −z (FRD), or (g − v̇_down)/cos(tilt).

    Returns:
        The map, or None if the thrust never changed or fewer than 10 samples follow its changes.
        Samples of steady thrust are left out.

    Raises:
        ValueError: a time series and its values are not one-dimensional and equally long.
    """
    record = _excited_samples(segments(time, thrust, measured_time, specific_thrust))
    fit = fit_lag(record, search_slew_limit=False)
    if fit is None:
        return None
    return ThrustMap(fit.gain, fit.offset, fit.lag, fit.dead_time, fit.fit.explained)
