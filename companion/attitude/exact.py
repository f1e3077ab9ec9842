"""`exact`: the paper's planner in discrete time, without its discretisation error."""

from math import asin, atan2, cos, exp, inf, sin, sqrt

from companion.attitude.kinematics import (
    SMALLEST_A,
    heading_of,
    into_body,
    levelling_rates,
    share_of_law,
    split,
)
from companion.attitude.limits import Constants
from companion.attitude.reference import distance_left
from companion.attitude.rotation import angle_per_sine, clamp, limit_rates, short_way
from companion.attitude.types import Quaternion, Target

SHORTEST_SAMPLE = 1e-4
"""s; a shorter sample is answered like this one: the rates differ from their limit by 1e-4·p."""
LONGEST_SAMPLE = 1.0
"""s; a longer one is answered like this one."""

_SETTLED = 1e-14
_PASSES = 20
"""Most iterations of the limits' fixed point; one leaves about θ²/12 of the error, 4 are usual."""


def exact(
    q: Quaternion, target: Target, dt: float, constants: Constants
) -> tuple[float, float, float]:
    """The one body rate that, held over the sample, ends where the first-order model ends.

    At the end of the sample the coefficients are c_d + (c − c_d)·e^(−p·dt), or as far along that
    line as the limits allow, and the heading has moved as asked (its error shrinks by e^(−k·dt)).
    The way there is the shortest rotation, so at the samples the response is exact at any rate.
    Beyond the recovery angle it is faded into a rotation towards level, as `first-order` is.
    """
    gain, yaw_gain, max_rate, max_yaw_rate, max_speed, _, _, _, cos_recovery, slope = constants
    dt = dt if dt > SHORTEST_SAMPLE else SHORTEST_SAMPLE
    dt = dt if dt < LONGEST_SAMPLE else LONGEST_SAMPLE
    w, x, y, z = q
    north, east, heading, heading_rate = target
    a, b, tilt_x, tilt_y, yaw_z = split(w, x, y, z)
    cosine = 2.0 * a * a - 1.0
    share = 1.0 if cosine >= cos_recovery else share_of_law(cosine, cos_recovery, slope)
    roll = pitch = yaw = 0.0
    if share > 0.0:
        north_left, east_left = north + 2.0 * a * tilt_y, east - 2.0 * a * tilt_x
        distance = sqrt(north_left * north_left + east_left * east_left)
        part = 1.0 - distance_left(1.0, gain, max_speed / distance if distance > 0.0 else inf, dt)
        error = short_way(heading - heading_of(a, w, z))
        turn = (1.0 - exp(-yaw_gain * dt)) * error + heading_rate * dt
        r_x, r_y, r_z = _rotation(
            a, tilt_x, tilt_y, north_left, east_left, part, turn, max_rate * dt, max_yaw_rate * dt
        )
        roll, pitch = into_body(b * b - yaw_z * yaw_z, 2.0 * b * yaw_z, r_x, r_y)
        roll *= share / dt
        pitch *= share / dt
        yaw = share / dt * r_z
    if share < 1.0:
        a = a if a > SMALLEST_A else SMALLEST_A
        up_roll, up_pitch = levelling_rates(gain, a, 1.0 / (a * a), w, x, y, z)
        up_roll, up_pitch, _ = limit_rates(up_roll, up_pitch, 0.0, max_rate, 0.0)
        roll += (1.0 - share) * up_roll
        pitch += (1.0 - share) * up_pitch
    return limit_rates(roll, pitch, yaw, max_rate, max_yaw_rate)


def _rotation(
    a: float,
    x: float,
    y: float,
    north_left: float,
    east_left: float,
    part: float,
    turn: float,
    max_angle: float,
    max_yaw_angle: float,
) -> tuple[float, float, float]:
    """Rotation vector (rad, seen from the heading there is) to `part` of the way to the target.

    It is Log(d ⊗ yaw(turn)), d leading from the tilt there is to the tilt to come. Both limits
    bound f = θ/sin(θ/2) times a component, where θ depends on the outcome: hence the fixed point.
    """
    f = 2.0
    r_x = r_y = r_z = 0.0
    for _ in range(_PASSES):
        reached = part
        if max_angle < inf:
            reached = _reach(a, x, y, north_left, east_left, part, max_angle / f)
        d_w, d_x, d_y, d_z = _tilt_change(a, x, y, reached * north_left, reached * east_left)
        length = sqrt(d_w * d_w + d_z * d_z)
        own_half = atan2(d_z, d_w)
        half = own_half + 0.5 * turn
        if max_yaw_angle < inf and f * length * abs(sin(half)) > max_yaw_angle:
            half = asin(clamp(sin(half), max_yaw_angle / (f * length)))
        r_w, r_z = length * cos(half), length * sin(half)
        cosine, sine = cos(half - own_half), sin(half - own_half)
        r_x, r_y = d_x * cosine + d_y * sine, d_y * cosine - d_x * sine
        if r_w < 0.0:
            r_w, r_x, r_y, r_z = -r_w, -r_x, -r_y, -r_z
        before = f
        f = angle_per_sine(r_w, sqrt(r_x * r_x + r_y * r_y + r_z * r_z))
        free = reached == part and max_yaw_angle == inf
        if abs(f - before) < _SETTLED or (free and f * sqrt(r_x * r_x + r_y * r_y) <= max_angle):
            break
    return f * r_x, f * r_y, f * r_z


def _tilt_change(
    a: float, x: float, y: float, north: float, east: float
) -> tuple[float, float, float, float]:
    """tilt⁻¹ ⊗ tilt', the latter with the coefficients moved by (north, east)."""
    north -= 2.0 * a * y
    east += 2.0 * a * x
    next_a = sqrt(0.5 * (1.0 + sqrt(1.0 - north * north - east * east)))
    next_x = 0.5 * east / next_a
    next_y = -0.5 * north / next_a
    return (
        a * next_a + x * next_x + y * next_y,
        a * next_x - x * next_a,
        a * next_y - y * next_a,
        y * next_x - x * next_y,
    )


def _reach(
    a: float,
    x: float,
    y: float,
    north_left: float,
    east_left: float,
    part: float,
    half_sine: float,
) -> float:
    """Share of the line, at most `part`, that a turn of the thrust axis by Θ allows.

    sin(Θ/2) = `half_sine`. With n the thrust axis along the line,
    n(0)·n(s) = cos Θ is a quadratic in s.
    """
    k = 2.0 * half_sine * half_sine  # 1 − cos Θ
    along = 2.0 * a * (x * east_left - y * north_left)
    square = north_left * north_left + east_left * east_left
    cosine = 2.0 * a * a - 1.0
    leading = along * along + cosine * cosine * square
    inside = along * along * k * k + leading * k * (2.0 * cosine * cosine - k)
    if leading <= 0.0 or inside <= 0.0:
        return part
    reached = (sqrt(inside) - along * k) / leading
    return reached if reached < part else part
