"""ArduCopter's normalised thrust: its curve, the angle boost, and the thrust field of setpoints.

Measured on 4.7.0-dev's built-in quadrotor, with GUID_OPTIONS bit 3 set.
"""

from itertools import pairwise
from math import isnan

from sitl_mock.physics.rigid_body import GRAVITY

HOVER_THRUST = 0.364
"""Normalised thrust that hovers, 0..1."""

_THRUST_CURVE = ((0.0, 0.045), (0.1, 0.29), (HOVER_THRUST, 1.0), (1.0, 2.745))
"""Points of the curve: (normalised thrust, specific thrust in g). From `HOVER_THRUST` on, the curve
is a straight line through the origin, and it is close to this line from 0.1 on. In circles,
figure-eights and steps between 0.3 and 0.6, the line is within 0.03 m/s^2 of the simulator's truth.
In a climb at constant thrust the vehicle accelerates less, because its drag grows quickly.
"""


def specific_thrust(thrust: float) -> float:
    """Return the specific thrust of a normalised thrust, m/s^2."""
    for (low_thrust, low_g), (high_thrust, high_g) in pairwise(_THRUST_CURVE):
        if thrust <= high_thrust:
            fraction = max(0.0, thrust - low_thrust) / (high_thrust - low_thrust)
            return GRAVITY * (low_g + fraction * (high_g - low_g))
    return GRAVITY * _THRUST_CURVE[-1][1]


def angle_boosted_thrust(thrust: float, cos_tilt: float) -> float:
    """Return the thrust divided by the cosine of the tilt, as ATC_ANGLE_BOOST does.

    Near 90 degrees of tilt and beyond, the thrust decreases to zero.
    """
    upright_factor = max(0.0, min(1.0, 10.0 * cos_tilt))
    return thrust * upright_factor / max(0.1, min(1.0, cos_tilt))


def thrust_of_setpoint(thrust: float) -> float:
    """Return the thrust that a setpoint's thrust field means: 0 for NaN, else limited to 0..1."""
    return 0.0 if isnan(thrust) else max(0.0, min(1.0, thrust))


def climb_rate_of_setpoint(thrust: float, fastest_up: float, fastest_down: float) -> float:
    """Return the climb rate of a setpoint's thrust field, m/s: 0 for 0.5 and for NaN.

    Args:
        thrust: the thrust field, 0..1.
        fastest_up: climb rate at 1, m/s.
        fastest_down: sink rate at 0, m/s.
    """
    rate_fraction = 0.0 if isnan(thrust) else 2.0 * max(0.0, min(1.0, thrust)) - 1.0
    return rate_fraction * (fastest_up if rate_fraction > 0.0 else fastest_down)
