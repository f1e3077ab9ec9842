"""ArduCopter's normalised thrust: what it gives, the angle boost, the climb rate it may stand for.

Measured on 4.7.0-dev's built-in quadrotor, with GUID_OPTIONS bit 3 set.
"""

from itertools import pairwise
from math import isnan

GRAVITY = 9.80665

HOVER = 0.364
"""Thrust that hovers."""

_MEASURED = (
    (0.0, 0.045),
    (0.1, 0.29),
    (0.2, 0.57),
    (0.3, 0.82),
    (HOVER, 1.0),
    (0.4, 1.09),
    (0.5, 1.33),
    (0.6, 1.58),
    (0.8, 2.03),
    (1.0, 2.30),
)
"""(normalised thrust, specific thrust in g)."""


def specific_thrust(thrust: float) -> float:
    """Return what a normalised thrust gives, m/s^2; straight lines between what was measured."""
    for (low, low_g), (high, high_g) in pairwise(_MEASURED):
        if thrust <= high:
            share = max(0.0, thrust - low) / (high - low)
            return GRAVITY * (low_g + share * (high_g - low_g))
    return GRAVITY * _MEASURED[-1][1]


def angle_boosted(thrust: float, cos_tilt: float) -> float:
    """Return the thrust divided by the cosine of the tilt, as ATC_ANGLE_BOOST does.

    Towards the horizon and beyond it the thrust is taken back to nothing.
    """
    upright = max(0.0, min(1.0, 10.0 * cos_tilt))
    return thrust * upright / max(0.1, min(1.0, cos_tilt))


def thrust_of_setpoint(thrust: float) -> float:
    """Return the thrust that a setpoint's field asks: NaN is none, infinity all (measured)."""
    return 0.0 if isnan(thrust) else max(0.0, min(1.0, thrust))


def climb_rate_of_setpoint(thrust: float, fastest_up: float, fastest_down: float) -> float:
    """Return the climb rate that a setpoint's thrust field asks, m/s: 0.5 and NaN are none.

    Args:
        thrust: the field.
        fastest_up: climb rate at 1, m/s.
        fastest_down: sink rate at 0, m/s.
    """
    way = 0.0 if isnan(thrust) else 2.0 * max(0.0, min(1.0, thrust)) - 1.0
    return way * (fastest_up if way > 0.0 else fastest_down)
