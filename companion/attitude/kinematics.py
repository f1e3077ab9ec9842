"""The tilt-yaw split of an attitude, and the body rates that move it (paper, equations 9 to 28).

Every formula stands here once, as arithmetic on plain floats: no branches on containers, no arrays,
so that it costs a flight well under a microsecond and can be compiled for batches unchanged.
"""

from math import sqrt


def split(w: float, x: float, y: float, z: float) -> tuple[float, float, float, float, float]:
    """Split a unit quaternion into (a, b, x, y, z), tilt ⊗ yaw (equation 9).

    Exactly inverted (w = z = 0) the heading is undefined; it is then taken as zero.
    """
    a = sqrt(w * w + z * z)
    if a < 1e-12:
        return 0.0, 1.0, x, y, 0.0
    return a, w / a, (w * x - z * y) / a, (z * x + w * y) / a, z / a


def cos_tilt(x: float, y: float) -> float:
    """Cosine of the tilt; `x`, `y` of the split or of the whole quaternion alike (equation 10)."""
    return 1.0 - 2.0 * (x * x + y * y)


def tilt_rates(
    a: float, x: float, y: float, e_x: float, e_y: float, cosine: float
) -> tuple[float, float, float]:
    """Rates (R_x, R_y, R_z) in the tilt frame that give d(2ax)/dt = e_x, d(2ay)/dt = e_y.

    Equations 21 to 24; R_z keeps the heading still. `cosine` is cos(tilt), or its floor where the
    caller has to keep the inverse bounded. Rates in rad/s.
    """
    r_x = ((1.0 - 2.0 * y * y) * e_x + 2.0 * x * y * e_y) / cosine
    r_y = ((1.0 - 2.0 * x * x) * e_y + 2.0 * x * y * e_x) / cosine
    return r_x, r_y, (y * r_x - x * r_y) / a


def to_body(b: float, z: float, r_x: float, r_y: float) -> tuple[float, float]:
    """Turn horizontal rates from the tilt frame into the body frame (equation 28)."""
    cosine = b * b - z * z
    sine = 2.0 * b * z
    return cosine * r_x + sine * r_y, cosine * r_y - sine * r_x


def shortest_arc_axis(w: float, x: float, y: float, z: float) -> tuple[float, float]:
    """Body axis (horizontal part, unit length) about which the thrust axis comes up soonest.

    It is body z × world down, seen from the body, and needs no division by cos(tilt) or by a, so it
    holds up to the inverted attitude; there every axis is as short, and roll is taken.
    """
    down_x = 2.0 * (x * z - w * y)
    down_y = 2.0 * (y * z + w * x)
    length = sqrt(down_x * down_x + down_y * down_y)
    if length < 1e-9:
        return 1.0, 0.0
    return -down_y / length, down_x / length
