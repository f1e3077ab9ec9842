"""Far beyond any tilt one asks for: bring the thrust axis up along the shortest arc.

The inverse of the kinematics grows as 1/cos(tilt), so from the recovery angle on a law that uses it
is faded, over 10°, into a plain rotation towards level.
"""

from companion.attitude.rotation import first_is_negative

SMALLEST_A = 1e-12
"""a = cos(tilt/2) below this counts as this: exactly inverted."""


def share_of_law(cosine: float, cos_recovery: float, slope: float) -> float:
    """1 at the recovery angle, 0 from 10° beyond it on, smooth between: no jump in rates."""
    ratio = 1.0 + slope * (cosine - cos_recovery)
    if ratio <= 0.0:
        return 0.0
    return ratio * ratio * (3.0 - 2.0 * ratio)


def levelling_rates(
    gain: float, a: float, inverse: float, w: float, x: float, y: float, z: float
) -> tuple[float, float]:
    """Body rates (roll, pitch) of 2·gain·sin(tilt/2), rad/s, about the axis of the tilt itself.

    `inverse` is 1/a². They need no division by cos(tilt), so they hold up to the inverted
    attitude, where every axis is as short as any other; the same is taken for q and −q.
    """
    if a <= SMALLEST_A:
        scale = 2.0 * gain if first_is_negative(x, y, 0.0) else -2.0 * gain
        return scale * x, scale * y
    scale = -2.0 * gain * a * inverse
    return scale * (w * x + z * y), scale * (w * y - z * x)
