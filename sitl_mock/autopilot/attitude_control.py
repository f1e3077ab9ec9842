"""PX4's attitude controller: body rates from the quaternion error, with a reduced yaw weight."""

from math import acos, asin, copysign, cos, isnan, sin, sqrt
from typing import NamedTuple

from sitl_mock.physics.quaternion import Quaternion, Vector, multiply, normalise

_OPPOSITE_MARGIN = 1e-5
"""Two axes count as opposite if the cosine of the angle between them is below -1 plus this margin.
No arc between opposite axes is the shortest."""


class AttitudeGains(NamedTuple):
    """Gains in 1/s, ``yaw_weight`` 0..1, rate limits in rad/s."""

    roll: float
    pitch: float
    yaw: float
    yaw_weight: float
    max_rates: Vector


def conjugate(q: Quaternion) -> Quaternion:
    """Return the inverse rotation."""
    w, x, y, z = q
    return (w, -x, -y, -z)


def body_z(q: Quaternion) -> Vector:
    """Return the body's down axis in world axes."""
    w, x, y, z = q
    return (2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y))


def attitude_rates(
    q: Quaternion, target: Quaternion, yaw_rate: float, gains: AttitudeGains
) -> Vector:
    """Return the body rates (rad/s, FRD) that turn ``q`` to ``target``.

    As PX4's AttitudeControl: the rotation of the thrust axis along the shortest arc has priority.
    The angle of the remaining rotation about this axis is multiplied by ``yaw_weight``, and the yaw
    gain is divided by ``yaw_weight``.

    `target`: attitude to reach, of any length. `yaw_rate`: feed-forward about the world's down
    axis, rad/s.
    """
    target = normalise(target)
    reduced_target = multiply(_shortest_arc(q, target), q)
    rest_rotation = multiply(conjugate(reduced_target), target)
    sign = copysign(1.0, rest_rotation[0])
    cos_half = max(-1.0, min(1.0, rest_rotation[0] * sign))
    sin_half = max(-1.0, min(1.0, rest_rotation[3] * sign))
    yaw_weight = gains.yaw_weight
    weighted_target = multiply(
        reduced_target,
        (cos(yaw_weight * acos(cos_half)), 0.0, 0.0, sin(yaw_weight * asin(sin_half))),
    )
    ew, ex, ey, ez = multiply(conjugate(q), weighted_target)
    error_scale = copysign(2.0, ew)
    yaw_gain = gains.yaw / yaw_weight if yaw_weight > 0.0 else gains.yaw
    down = body_z(conjugate(q))  # the world's down axis in body axes
    max_rates = gains.max_rates
    return (
        _clamp(error_scale * ex * gains.roll + down[0] * yaw_rate, max_rates[0]),
        _clamp(error_scale * ey * gains.pitch + down[1] * yaw_rate, max_rates[1]),
        _clamp(error_scale * ez * yaw_gain + down[2] * yaw_rate, max_rates[2]),
    )


def is_usable_quaternion(q: Quaternion) -> bool:
    """Whether a quaternion has no NaN, and a length between 0.001 and 1000."""
    w, x, y, z = q
    squared_length = w * w + x * x + y * y + z * z
    return not isnan(squared_length) and 1e-6 < squared_length < 1e6


def _shortest_arc(q: Quaternion, target: Quaternion) -> Quaternion:
    """Return the world rotation that takes the body's down axis of ``q`` to that of ``target``."""
    ax, ay, az = body_z(q)
    bx, by, bz = body_z(target)
    dot = ax * bx + ay * by + az * bz
    if dot < -1.0 + _OPPOSITE_MARGIN:
        return multiply(target, conjugate(q))
    w = sqrt(2.0 * (1.0 + dot))
    return normalise(
        (0.5 * w, (ay * bz - az * by) / w, (az * bx - ax * bz) / w, (ax * by - ay * bx) / w)
    )


def _clamp(value: float, bound: float) -> float:
    return max(-bound, min(bound, value))
