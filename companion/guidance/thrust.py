"""Thrust: from the wanted acceleration to specific thrust in m/s², height first."""

from math import acos, hypot, sqrt

from companion.attitude import BodyRates, Quaternion
from companion.attitude.kinematics import cos_tilt
from companion.guidance.reference import GRAVITY, Vector

FOR_TILT = 0.95
"""Share of the largest thrust that may be spent on tilt; what is left climbs against a gust."""

_MIN_COSINE = 0.5
"""Beyond 60° of tilt height is given up rather than thrust raised without end."""


def specific_thrust(acceleration_down: float, cos_tilt: float) -> float:
    """T = (g − a_D)/cos(tilt) in m/s², with the tilt there is.

    Beyond 60° of tilt thrust fades instead, to none at 90°: upside down it would push the vehicle
    to the ground.
    """
    wanted = max(0.0, GRAVITY - acceleration_down)
    if cos_tilt < _MIN_COSINE:
        return wanted * max(0.0, cos_tilt) / (_MIN_COSINE * _MIN_COSINE)
    return wanted / cos_tilt


def cos_tilt_ahead(q: Quaternion, body_rates: BodyRates, ahead: float) -> float:
    """Cosine of the tilt that the vehicle will have in `ahead` seconds if it rotates on like this.

    Thrust for this tilt instead of the present one makes up for the lag of the rotors while the
    vehicle tilts: T + lag·Ṫ, to first order. From Ṙ = R·[ω]ₓ, third row.
    """
    w, x, y, z = q
    north, east = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x)
    cosine = cos_tilt(x, y) + ahead * (north * body_rates.pitch - east * body_rates.roll)
    return min(max(cosine, -1.0), 1.0)


def largest_tilt(lift: float, largest: float) -> float:
    """The largest tilt at which the thrust still gives the lift, rad; 0 where none is to spare.

    Args:
        lift: upward part of the specific thrust, m/s².
        largest: specific thrust, m/s².
    """
    if lift >= FOR_TILT * largest:
        return 0.0
    return acos(max(lift, 0.0) / (FOR_TILT * largest))


def height_first(wanted: Vector, smallest: float, largest: float) -> Vector:
    """The acceleration nearest to `wanted` that thrust within its limits gives.

    What thrust cannot give is taken from the horizontal part, whose direction is kept: the target's
    tilt shrinks and the height stays. The last of the thrust (`FOR_TILT`) is kept for the height.
    Only with too little thrust asked for, as in a fast descent, the vertical part gives way, for
    thrust cannot be less.

    Args:
        wanted: acceleration NED, m/s².
        smallest: specific thrust, m/s².
        largest: specific thrust, m/s².

    Returns:
        Acceleration NED, m/s².
    """
    north, east, down = wanted
    lift = min(max(GRAVITY - down, 0.0), largest)
    spare = (FOR_TILT * largest) ** 2 - lift * lift
    length, most = hypot(north, east), sqrt(max(spare, 0.0))
    if length > most:
        north, east, length = north * most / length, east * most / length, most
    if lift * lift + length * length < smallest * smallest:
        lift = sqrt(smallest * smallest - length * length)
    return north, east, GRAVITY - lift
