"""`exact`: the paper's planner in discrete time, without its discretisation error."""

from math import asin, atan2, cos, exp, inf, sin, sqrt

from companion.attitude.kinematics import (
    SMALLEST_A,
    heading_of,
    law_weight,
    levelling_rates,
    rotate_to_heading,
    split,
)
from companion.attitude.limits import Constants
from companion.attitude.reference import remaining_distance
from companion.attitude.rotation import angle_per_sine, clamp, limit_rates, wrap_difference
from companion.attitude.types import Quaternion, Target

SHORTEST_PERIOD = 1e-4
"""Shortest sample period that is used, s; a shorter one is replaced by this value. The rates then
differ from the exact ones by at most 1e-4·p (relative).
"""
LONGEST_PERIOD = 1.0
"""Longest sample period that is used, s; a longer one is replaced by this value."""

_LARGEST_SETTLED_CHANGE = 1e-14
"""Change of the factor f in `_rotation` below which the fixed-point iteration ends."""
_MAX_ITERATIONS = 20
"""Largest number of fixed-point iterations in `_rotation`. Usually 4 suffice: each multiplies the
error by about θ²/12, where θ (rad) is the angle of the rotation in a sample period."""


def exact(
    q: Quaternion, target: Target, dt: float, constants: Constants
) -> tuple[float, float, float]:
    """The constant body rates, rad/s, that reach the state of the linear model after `dt` s.

    In that state the coefficients are c_d + (c − c_d)·e^(−p·dt), or as far along the line to c_d as
    the limits allow. The heading error has shrunk by the factor e^(−yaw_gain·dt), and the heading
    has also turned by heading_rate·dt. The vehicle moves there by the shortest rotation, so at the
    samples the response is exact at any sample rate. Beyond the recovery angle the law fades into a
    rotation towards level, as in `first-order`. A `dt` above 1 s counts as 1 s.
    """
    gain, yaw_gain, max_rate, max_yaw_rate, max_speed, _, _, _, cos_recovery, law_slope = constants
    dt = dt if dt > SHORTEST_PERIOD else SHORTEST_PERIOD
    dt = dt if dt < LONGEST_PERIOD else LONGEST_PERIOD
    w, x, y, z = q
    north, east, heading, heading_rate = target
    a, b, tilt_x, tilt_y, yaw_z = split(w, x, y, z)
    cosine = 2.0 * a * a - 1.0
    weight = 1.0 if cosine >= cos_recovery else law_weight(cosine, cos_recovery, law_slope)
    roll = pitch = yaw = 0.0
    if weight > 0.0:
        remaining_north, remaining_east = north + 2.0 * a * tilt_y, east - 2.0 * a * tilt_x
        distance = sqrt(remaining_north * remaining_north + remaining_east * remaining_east)
        wanted_share = 1.0 - remaining_distance(
            1.0, gain, max_speed / distance if distance > 0.0 else inf, dt
        )
        heading_error = wrap_difference(heading - heading_of(a, w, z))
        heading_change = (1.0 - exp(-yaw_gain * dt)) * heading_error + heading_rate * dt
        r_x, r_y, r_z = _rotation(
            a,
            tilt_x,
            tilt_y,
            remaining_north,
            remaining_east,
            wanted_share,
            heading_change,
            max_rate * dt,
            max_yaw_rate * dt,
        )
        roll, pitch = rotate_to_heading(b * b - yaw_z * yaw_z, 2.0 * b * yaw_z, r_x, r_y)
        roll *= weight / dt
        pitch *= weight / dt
        yaw = weight / dt * r_z
    if weight < 1.0:
        a = a if a > SMALLEST_A else SMALLEST_A
        roll_rate, pitch_rate = levelling_rates(gain, a, 1.0 / (a * a), w, x, y, z)
        roll_rate, pitch_rate, _ = limit_rates(roll_rate, pitch_rate, 0.0, max_rate, 0.0)
        roll += (1.0 - weight) * roll_rate
        pitch += (1.0 - weight) * pitch_rate
    return limit_rates(roll, pitch, yaw, max_rate, max_yaw_rate)


def _rotation(
    a: float,
    x: float,
    y: float,
    remaining_north: float,
    remaining_east: float,
    wanted_share: float,
    heading_change: float,
    max_angle: float,
    max_yaw_angle: float,
) -> tuple[float, float, float]:
    """Rotation vector of one sample, rad, at heading 0: Log(q) with q = d ⊗ yaw(heading_change).

    The rotation d changes the tilt (a, x, y, 0) so that the coefficients move by `wanted_share` of
    the remaining way (north, east) to the target, or less if `max_angle` (rad) is reached. Log(q)
    is f = θ/sin(θ/2) times the vector part of q, where θ is the angle of q. The limits depend on
    f, and f depends on θ, so f is found by fixed-point iteration.
    """
    f = 2.0
    r_x = r_y = r_z = 0.0
    for _ in range(_MAX_ITERATIONS):
        moved_share = wanted_share
        if max_angle < inf:
            moved_share = _reachable_share(
                a, x, y, remaining_north, remaining_east, wanted_share, max_angle / f
            )
        d_w, d_x, d_y, d_z = _tilt_change(
            a, x, y, moved_share * remaining_north, moved_share * remaining_east
        )
        length = sqrt(d_w * d_w + d_z * d_z)
        half_tilt_yaw = atan2(d_z, d_w)
        half_yaw = half_tilt_yaw + 0.5 * heading_change
        if max_yaw_angle < inf and f * length * abs(sin(half_yaw)) > max_yaw_angle:
            half_yaw = asin(clamp(sin(half_yaw), max_yaw_angle / (f * length)))
        r_w, r_z = length * cos(half_yaw), length * sin(half_yaw)
        cosine, sine = cos(half_yaw - half_tilt_yaw), sin(half_yaw - half_tilt_yaw)
        r_x, r_y = d_x * cosine + d_y * sine, d_y * cosine - d_x * sine
        if r_w < 0.0:
            r_w, r_x, r_y, r_z = -r_w, -r_x, -r_y, -r_z
        previous_f = f
        f = angle_per_sine(r_w, sqrt(r_x * r_x + r_y * r_y + r_z * r_z))
        is_unlimited = moved_share == wanted_share and max_yaw_angle == inf
        if abs(f - previous_f) < _LARGEST_SETTLED_CHANGE or (
            is_unlimited and f * sqrt(r_x * r_x + r_y * r_y) <= max_angle
        ):
            break
    return f * r_x, f * r_y, f * r_z


def _tilt_change(
    a: float, x: float, y: float, north: float, east: float
) -> tuple[float, float, float, float]:
    """The rotation tilt⁻¹ ⊗ tilt' that adds (north, east) to the coefficients of the tilt.

    tilt is the quaternion (a, x, y, 0), and tilt' the tilt with the new coefficients.
    """
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


def _reachable_share(
    a: float,
    x: float,
    y: float,
    remaining_north: float,
    remaining_east: float,
    wanted_share: float,
    half_sine: float,
) -> float:
    """Share of the line to the target that the coefficients cover if the thrust axis turns by Θ.

    `half_sine` is sin(Θ/2); the result is at most `wanted_share`. If n(s) is the thrust axis at the
    share s of the line, n(0)·n(s) = cos Θ is a quadratic equation in s.
    """
    k = 2.0 * half_sine * half_sine  # 1 − cos Θ
    projection = 2.0 * a * (x * remaining_east - y * remaining_north)
    distance_squared = remaining_north * remaining_north + remaining_east * remaining_east
    cosine = 2.0 * a * a - 1.0
    leading_coefficient = projection * projection + cosine * cosine * distance_squared
    discriminant = projection * projection * k * k + leading_coefficient * k * (
        2.0 * cosine * cosine - k
    )
    if leading_coefficient <= 0.0 or discriminant <= 0.0:
        return wanted_share
    share = (sqrt(discriminant) - projection * k) / leading_coefficient
    return share if share < wanted_share else wanted_share
