"""Specific thrust over the normalised thrust that MAVLink carries, from what a flight measured."""

from dataclasses import dataclass

from numpy.typing import ArrayLike

from companion.identification.fit import fit_lag
from companion.identification.record import stretches

_LEAST_EXPLAINED = 0.8
_LARGEST_DELAY = 0.5
"""Rotors and their commands are not slower than this together, s."""


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

    def is_good(self) -> bool:
        """Whether the thrust followed the commands upwards, soon, and by little else."""
        return (
            self.slope > 0.0
            and self.explained >= _LEAST_EXPLAINED
            and self.lag + self.dead_time < _LARGEST_DELAY
        )


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
        The map, or None where the thrust never changed.

    Raises:
        ValueError: a time series and its values are not two rows of equal length.
    """
    found = fit_lag(stretches(time, thrust, measured_time, specific_thrust))
    if found is None:
        return None
    return ThrustMap(found.gain, found.offset, found.lag, found.dead_time, found.explained)
