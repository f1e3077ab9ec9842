"""What every law is computed with: gains and limits as the plain numbers of its formulas."""

from math import cos, inf, radians, sin
from typing import NamedTuple

from companion.attitude.limits import Limits

RECOVERY_ANGLE = radians(75.0)
RECOVERY_BLEND = radians(10.0)


class Constants(NamedTuple):
    """Gains, limits and the recovery of one planner; a limit that is not set is infinite.

    The weights are 1/limit², 0 where there is none: a rate is over its limit when weight·rate² > 1.
    """

    gain: float  # p, 1/s
    yaw_gain: float  # 1/s
    max_tilt_rate: float  # W_M, rad/s
    max_yaw_rate: float  # rad/s
    max_speed: float  # of the coefficients, 1/s: W_M·cos(max_tilt) in the paper's shape (eq 33)
    tilt_rate_weight: float  # s²/rad²
    speed_weight: float  # s²
    longest_target: float  # coefficients, sin of the largest tilt
    cos_recovery: float  # below this cosine of the tilt, recovery begins
    recovery_slope: float  # 1/(cos(recovery angle) − cos(where the law has faded out))


def make_constants(
    gain: float, yaw_gain: float, limits: Limits, recovery_angle: float = RECOVERY_ANGLE
) -> Constants:
    """Check the options of a planner and turn them into the numbers of its law.

    Args:
        gain: p, 1/s.
        yaw_gain: proportional gain on the heading error, 1/s.
        limits: bounds; see `Limits`.
        recovery_angle: rad; must lie above `limits.max_tilt` and at most 80°.

    Raises:
        ValueError: a gain or the recovery angle is out of range.
    """
    if not 0.0 < gain < inf:
        raise ValueError(f"gain must be positive and finite, not {gain}")
    if not 0.0 <= yaw_gain < inf:
        raise ValueError(f"yaw_gain must be finite and not negative, not {yaw_gain}")
    if not 0.0 < recovery_angle <= radians(80.0):
        raise ValueError(f"recovery_angle must be in (0, 80°], not {recovery_angle} rad")
    max_tilt = recovery_angle if limits.max_tilt is None else limits.max_tilt
    if max_tilt > recovery_angle:
        raise ValueError("max_tilt must not exceed the recovery angle")
    max_speed = limits.coefficient_speed
    return Constants(
        gain=gain,
        yaw_gain=yaw_gain,
        max_tilt_rate=limits.tilt_rate,
        max_yaw_rate=limits.yaw_rate,
        max_speed=max_speed,
        tilt_rate_weight=limits.tilt_rate**-2,
        speed_weight=max_speed**-2,
        longest_target=sin(max_tilt),
        cos_recovery=cos(recovery_angle),
        recovery_slope=1.0 / (cos(recovery_angle) - cos(recovery_angle + RECOVERY_BLEND)),
    )
