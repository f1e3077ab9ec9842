"""The tilt-yaw split of an attitude, and the body rates that move it (paper, equations 9 to 28).

Every formula is arithmetic on plain floats, without arrays. In flight it takes well under a
microsecond, and a batch compiles the same source. Most formulas need only a², a·x and a·y, and
therefore no square root and no division.
"""

from math import acos, atan, sqrt

from companion.attitude.rotation import first_nonzero_is_negative

SMALLEST_A = 1e-12
"""Smallest value used for a = cos(tilt/2); below it the vehicle counts as exactly inverted."""


def half_tilt_products(w: float, x: float, y: float, z: float) -> tuple[float, float, float]:
    """(a², a·x, a·y) of `split`; cos(tilt) = 2a² − 1, coefficients (−2ay, +2ax) (equation 10)."""
    return w * w + z * z, w * x - z * y, z * x + w * y


def split(w: float, x: float, y: float, z: float) -> tuple[float, float, float, float, float]:
    """Split a unit quaternion into tilt (a, x, y, 0) ⊗ yaw (b, 0, 0, z); return (a, b, x, y, z).

    This is equation 9. The returned x, y and z differ from those of the argument.
    The heading of an exactly inverted attitude (w = z = 0) is undefined; it is taken as zero.
    """
    a = sqrt(w * w + z * z)
    if a < SMALLEST_A:
        return 0.0, 1.0, x, y, 0.0
    _, ax, ay = half_tilt_products(w, x, y, z)
    return a, w / a, ax / a, ay / a, z / a


def cos_tilt(x: float, y: float) -> float:
    """Cosine of the tilt (equation 10); `x`, `y`: of the tilt by `split`, or of the attitude."""
    return 1.0 - 2.0 * (x * x + y * y)


def tilt_angle(x: float, y: float) -> float:
    """Tilt, rad, from `x`, `y` as in `cos_tilt`; a norm slightly above 1 is accepted."""
    return acos(max(-1.0, min(1.0, cos_tilt(x, y))))


def speed_to_rates(
    w: float,
    z: float,
    ax: float,
    ay: float,
    inverse_a_squared: float,
    inverse_cos_tilt: float,
    e_x: float,
    e_y: float,
) -> tuple[float, float, float]:
    """Body rates (rad/s) that give d(2ax)/dt = e_x, d(2ay)/dt = e_y and hold the heading.

    Equations 21 to 24 with their common term (y·e_x − x·e_y) factored out, then equation 28.
    `inverse_a_squared` is 1/a². `inverse_cos_tilt` is 1/cos(tilt); the caller may bound it near 90°
    of tilt, so that the rates stay bounded.
    """
    common_term = 2.0 * inverse_a_squared * (ay * e_x - ax * e_y)
    r_x = inverse_cos_tilt * (e_x - ay * common_term)
    r_y = inverse_cos_tilt * (e_y + ax * common_term)
    cosine = (w * w - z * z) * inverse_a_squared
    sine = 2.0 * w * z * inverse_a_squared
    return (
        cosine * r_x + sine * r_y,
        cosine * r_y - sine * r_x,
        (ay * r_x - ax * r_y) * inverse_a_squared,
    )


def rotate_to_heading(cosine: float, sine: float, r_x: float, r_y: float) -> tuple[float, float]:
    """Rotate roll and pitch rate from heading 0 to a heading, given by cosine and sine (eq. 28)."""
    return cosine * r_x + sine * r_y, cosine * r_y - sine * r_x


def rates_to_speed(
    w: float, x: float, y: float, z: float, roll_rate: float, pitch_rate: float, yaw_rate: float
) -> tuple[float, float, float]:
    """Speed of the coefficients (north, east; 1/s) and of the heading (rad/s) at given body rates.

    The inverse of `speed_to_rates`. At body rates ω (rad/s) the thrust axis −R·e_z moves with
    −R·(ω × e_z). The heading turns at the yaw rate minus the yaw rate that holds the heading.
    """
    north = 2.0 * (x * y - w * z) * roll_rate - (1.0 - 2.0 * (y * y + z * z)) * pitch_rate
    east = (1.0 - 2.0 * (x * x + z * z)) * roll_rate - 2.0 * (x * y + w * z) * pitch_rate
    a_squared, ax, ay = half_tilt_products(w, x, y, z)
    inverse_a_squared = 1.0 / a_squared
    _, _, heading_hold_rate = speed_to_rates(
        w, z, ax, ay, inverse_a_squared, 1.0 / (2.0 * a_squared - 1.0), east, -north
    )
    return north, east, yaw_rate - heading_hold_rate


def heading_of(a: float, w: float, z: float) -> float:
    """Tilt-yaw heading 2·atan2(z, w) in rad, in [−π, π]; a² = w² + z², a > 0.

    The heading of q and −q is equal, but a half turn may be −π for one and π for the other. The
    half-angle formula keeps the argument of the arctangent between −1 and 1.
    """
    return 4.0 * atan(z / (w + a if w >= 0.0 else w - a))


def law_weight(cosine: float, cos_recovery: float, recovery_slope: float) -> float:
    """Weight of the law beyond the recovery angle; the rest is the weight of the rotation to level.

    The weight falls smoothly from 1 at the recovery angle to 0 at 10° more tilt
    (`limits.RECOVERY_BLEND_ANGLE`). The formula is not valid below the recovery angle. `cosine` is
    cos(tilt), `recovery_slope` is `Constants.recovery_slope`.
    """
    blend = 1.0 + recovery_slope * (cosine - cos_recovery)
    if blend <= 0.0:
        return 0.0
    return blend * blend * (3.0 - 2.0 * blend)


def levelling_rates(
    gain: float, a: float, inverse_a_squared: float, w: float, x: float, y: float, z: float
) -> tuple[float, float]:
    """Body rates (roll, pitch) that rotate the vehicle to level at 2·gain·sin(tilt/2), rad/s.

    The rotation is about the tilt axis and is not divided by cos(tilt), so it is valid up to the
    inverted attitude. When inverted, every horizontal axis leads to level equally fast; q and −q
    give the same axis.
    """
    if a <= SMALLEST_A:
        scale = 2.0 * gain if first_nonzero_is_negative(x, y, 0.0) else -2.0 * gain
        return scale * x, scale * y
    scale = -2.0 * gain * a * inverse_a_squared
    return scale * (w * x + z * y), scale * (w * y - z * x)
