"""Specific thrust over normalised thrust (SET_ATTITUDE_TARGET), fitted to a flight."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from companion.identification.fit import fit_lag
from companion.identification.record import Stretch, stretches

_LEAST_EXPLAINED = 0.8
_FAR = 0.2
"""A command is excited if it differs from the median by this share of the range."""
_HOVER = 0.05, 0.95
"""Range of the normalised thrust at hover that the configuration accepts."""
_LARGEST_DELAY = 0.5
"""Largest sum of lag and dead time of the rotors, s."""


@dataclass(frozen=True, slots=True)
class ThrustMap:
    """T = slope·u + offset, reached with the rotors' lag.

    Attributes:
        slope: m/s² per unit of normalised thrust.
        offset: m/s².
        lag: of the rotors, s.
        dead_time: s.
        explained: R².
    """

    slope: float
    offset: float
    lag: float
    dead_time: float
    explained: float

    def normalised(self, specific_thrust: float) -> float:
        """The normalised thrust that gives a specific thrust in m/s²."""
        return (specific_thrust - self.offset) / self.slope

    def is_good(self, gravity: float) -> bool:
        """Whether the thrust followed the commands: rising, soon, and well explained.

        Args:
            gravity: m/s²; the vehicle must hover between 0.05 and 0.95.
        """
        return (
            self.slope > 0.0
            and self.explained >= _LEAST_EXPLAINED
            and self.lag + self.dead_time < _LARGEST_DELAY
            and _HOVER[0] < self.normalised(gravity) < _HOVER[1]
        )

    def described(self) -> str:
        """In one line."""
        return (
            f"T/m = {self.slope:.2f}·u {self.offset:+.2f} m/s² for u in 0..1, lag "
            f"{1e3 * self.lag:.0f} ms, dead time {1e3 * self.dead_time:.0f} ms, explains "
            f"{self.explained:.1%}"
        )


def _excited(record: list[Stretch]) -> list[Stretch]:
    """The record without samples of steady thrust: they hold only vibration and gusts."""
    if not record:
        return []
    thrust = np.concatenate([part.commanded for part in record])
    usual, far = float(np.median(thrust)), _FAR * float(np.ptp(thrust))
    excited = []
    for part in record:
        changed = part.time[np.abs(part.commanded - usual) > far]
        latest = np.searchsorted(changed, part.measured_time, side="right")
        since = part.measured_time - np.concatenate(([-np.inf], changed))[latest]
        told = since < _LARGEST_DELAY
        if told.any():
            measured = part.measured_time[told], part.measured[told]
            excited.append(Stretch(part.time, part.commanded, *measured))
    return excited


def fit_thrust_map(
    time: ArrayLike, thrust: ArrayLike, measured_time: ArrayLike, specific_thrust: ArrayLike
) -> ThrustMap | None:
    """Least squares of a straight line behind a first-order lag with dead time.

    Thrust doublets of a level, slow vehicle tell best: in fast flight drag along the body's z axis
    is taken for thrust.

    Args:
        time: (n,), vehicle time of the sample that each command answered, s.
        thrust: (n,), normalised, 0..1; rows that are not finite are left out.
        measured_time: (m,), vehicle time, s; need not be regular.
        specific_thrust: (m,), m/s²: the accelerometer's −z (FRD), or (g − v̇_down)/cos(tilt).

    Returns:
        The map, or None where the thrust never changed. Samples of steady thrust are left out.

    Raises:
        ValueError: a time series and its values are not two rows of equal length.
    """
    record = _excited(stretches(time, thrust, measured_time, specific_thrust))
    found = fit_lag(record, may_slew=False)
    if found is None:
        return None
    return ThrustMap(found.gain, found.offset, found.lag, found.dead_time, found.explained)
