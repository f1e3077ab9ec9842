"""Rotations on plain floats: products, logarithm, Euler angles, rotation at a constant body rate.

As in `kinematics`, every formula is arithmetic on scalars: a flight calls it, and a batch compiles
the same function. A batch may replace `cos_and_sinc` by a polynomial (`companion.batch.series`).
"""

from math import asin, atan2, cos, pi, sin, sqrt

from companion.attitude.types import Quaternion

_SMALL_ANGLE = 1e-12
"""Half angle h, rad, below which sin(h)/h is 1 to double precision."""


def attitude_of(north: float, east: float, heading: float) -> Quaternion:
    """The upright attitude with these coefficients (of length 1 at most) and this heading (rad)."""
    a = sqrt((1.0 + sqrt(1.0 - north * north - east * east)) / 2.0)
    x = east / (2.0 * a)
    y = -north / (2.0 * a)
    b = cos(heading / 2.0)
    z = sin(heading / 2.0)
    return a * b, x * b + y * z, y * b - x * z, a * z


def body_error(q: Quaternion, goal: Quaternion) -> Quaternion:
    """The shorter rotation from `q` to `goal` in the body frame, q⁻¹ ⊗ q_d with w ≥ 0.

    An exact half turn is equally short both ways; the same way is chosen for q and −q.
    """
    w, x, y, z = q
    w_d, x_d, y_d, z_d = goal
    w_e = w * w_d + x * x_d + y * y_d + z * z_d
    x_e = w * x_d - x * w_d - y * z_d + z * y_d
    y_e = w * y_d - y * w_d - z * x_d + x * z_d
    z_e = w * z_d - z * w_d - x * y_d + y * x_d
    if w_e < 0.0 or (w_e == 0.0 and first_nonzero_is_negative(x_e, y_e, z_e)):
        return -w_e, -x_e, -y_e, -z_e
    return w_e, x_e, y_e, z_e


def first_nonzero_is_negative(x: float, y: float, z: float) -> bool:
    """Whether the first nonzero component is negative: for v ≠ 0, true for one of v and −v."""
    return x < 0.0 or (x == 0.0 and (y < 0.0 or (y == 0.0 and z < 0.0)))


def angle_per_sine(w: float, sine: float) -> float:
    """The factor θ/sin(θ/2) of a rotation with scalar part w ≥ 0 and `sine` = |vector part|.

    The factor scales the vector part v of a unit quaternion q to its rotation vector:
    Log(q) = θ/sin(θ/2)·v.
    """
    if sine < _SMALL_ANGLE:
        return 2.0
    return 2.0 * atan2(sine, w) / sine


def cos_and_sinc(h_squared: float) -> tuple[float, float]:
    """cos(h) and sin(h)/h of an angle h in rad, given as h²."""
    h = sqrt(h_squared)
    return cos(h), sin(h) / h if h > _SMALL_ANGLE else 1.0


def after_constant_rates(q: Quaternion, rates: tuple[float, float, float], dt: float) -> Quaternion:
    """The attitude after `dt` seconds at constant body rates (rad/s): q ⊗ exp(ω·dt/2)."""
    w, x, y, z = q
    roll, pitch, yaw = rates
    i = 0.5 * dt * roll
    j = 0.5 * dt * pitch
    k = 0.5 * dt * yaw
    c, s = cos_and_sinc(i * i + j * j + k * k)
    i *= s
    j *= s
    k *= s
    w, x, y, z = (
        w * c - x * i - y * j - z * k,
        x * c + w * i + y * k - z * j,
        y * c + w * j + z * i - x * k,
        z * c + w * k + x * j - y * i,
    )
    # One Newton step of 1/√ corrects the norm, which rounding would change by 1e-12 in 2000 steps.
    scale = 1.5 - 0.5 * (w * w + x * x + y * y + z * z)
    return w * scale, x * scale, y * scale, z * scale


def turned_about_vertical(q: Quaternion, angle: float) -> Quaternion:
    """The attitude rotated about the world's down axis by `angle`, rad: clockwise from above."""
    c, s = cos(0.5 * angle), sin(0.5 * angle)
    w, x, y, z = q
    return c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w


def down_in_body(q: Quaternion) -> tuple[float, float, float]:
    """The world's down axis in the body's frame, FRD; its last component is cos(tilt)."""
    w, x, y, z = q
    return 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)


def euler_angles(q: Quaternion) -> tuple[float, float, float]:
    """Roll, pitch, yaw in rad of the sequence Z-Y-X, as autopilots report them."""
    w, x, y, z = q
    sine = 2.0 * (w * y - z * x)
    sine = 1.0 if sine > 1.0 else -1.0 if sine < -1.0 else sine
    return (
        atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
        asin(sine),
        atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
    )


def clamp(value: float, bound: float) -> float:
    """`value` limited to ±`bound`; `bound` is not negative."""
    if value > bound:
        return bound
    if value < -bound:
        return -bound
    return value


def limit_rates(
    roll: float, pitch: float, yaw: float, max_tilt_rate: float, max_yaw_rate: float
) -> tuple[float, float, float]:
    """Body rates, rad/s, with roll and pitch scaled together to their limit and yaw clamped."""
    rate = sqrt(roll * roll + pitch * pitch)
    if rate > max_tilt_rate:
        scale = max_tilt_rate / rate
        roll *= scale
        pitch *= scale
    return roll, pitch, clamp(yaw, max_yaw_rate)


def wrap_difference(angle: float) -> float:
    """Wrap an angle between −2π and 2π, such as a difference of two headings, to (−π, π]."""
    if angle > pi:
        return angle - 2.0 * pi
    if angle <= -pi:
        return angle + 2.0 * pi
    return angle
