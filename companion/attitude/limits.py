"""Limits of a planner, and the constants of its law."""

from dataclasses import dataclass
from math import cos, inf, isfinite, pi, radians, sin
from typing import Literal, NamedTuple

SMALLEST_LIMIT = 1e-6
"""Smallest limit, gain and damping that are accepted, in SI units."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of tilt and body rates; `None` is no limit.

    Attributes:
        max_tilt: largest tilt of a target, rad, in (0, π/2).
        max_tilt_rate: W_M, largest √(ω_x² + ω_y²), rad/s.
        max_yaw_rate: largest |ω_z|, rad/s.
        shape: form of the limit W_M. "tight" scales the tilt rate only where it would exceed W_M;
            "paper" also bounds the speed of the coefficients by W_M·cos(max_tilt) (equation 33),
            which is slower.

    Raises:
        ValueError: a limit is not positive and finite, `max_tilt` is 90° or more, the shape is
            unknown, or the shape "paper" limits the tilt rate without `max_tilt`.
    """

    max_tilt: float | None = None
    max_tilt_rate: float | None = None
    max_yaw_rate: float | None = None
    shape: Literal["tight", "paper"] = "tight"

    def __post_init__(self) -> None:
        for name in ("max_tilt", "max_tilt_rate", "max_yaw_rate"):
            value = getattr(self, name)
            if value is not None and not (isfinite(value) and value >= SMALLEST_LIMIT):
                raise ValueError(f"{name} must be positive and finite, not {value}")
        if self.max_tilt is not None and self.max_tilt >= pi / 2.0:
            raise ValueError(f"max_tilt must be below 90°, not {self.max_tilt:.4g} rad")
        if self.shape not in ("tight", "paper"):
            raise ValueError(
                f"shape of the rate limit must be 'tight' or 'paper', not {self.shape!r}"
            )
        if self.shape == "paper" and self.max_tilt_rate is not None and self.max_tilt is None:
            raise ValueError("the rate limit's shape 'paper' needs max_tilt (equation 33)")

    @property
    def tilt_rate(self) -> float:
        """Limit W_M of the tilt rate, rad/s; infinite if `max_tilt_rate` is None."""
        return inf if self.max_tilt_rate is None else self.max_tilt_rate

    @property
    def coefficient_speed(self) -> float:
        """Limit of the speed of the coefficients, 1/s: W_M·cos(max_tilt) (equation 33).

        Infinite unless the shape is "paper" and both tilt and tilt rate are limited.
        """
        if self.shape != "paper" or self.max_tilt is None:
            return inf
        return self.tilt_rate * cos(self.max_tilt)

    @property
    def yaw_rate(self) -> float:
        """Limit of the yaw rate, rad/s; infinite if `max_yaw_rate` is None."""
        return inf if self.max_yaw_rate is None else self.max_yaw_rate


RECOVERY_ANGLE = radians(75.0)
"""Default recovery angle: the tilt from which a planner rotates the vehicle towards level, rad."""
RECOVERY_BLEND_ANGLE = radians(10.0)
"""Range of tilt beyond the recovery angle over which the law fades out, rad."""


class Constants(NamedTuple):
    """Gains, limits and recovery angle of one planner; a limit that is not set is infinite.

    A law needs `gain`, `max_tilt_rate` and `max_yaw_rate`; the others are computed once for the
    laws of this package.

    Attributes:
        gain: p, 1/s.
        yaw_gain: proportional gain on the heading error, 1/s.
        max_tilt_rate: W_M, largest √(ω_x² + ω_y²), rad/s.
        max_yaw_rate: largest |ω_z|, rad/s.
        max_speed: largest speed of the coefficients, 1/s: `Limits.coefficient_speed`.
        tilt_rate_weight: 1/max_tilt_rate², s²/rad², 0 without a limit: a tilt rate exceeds the
            limit if weight·rate² > 1.
        speed_weight: 1/max_speed², s², 0 without a limit: used like `tilt_rate_weight`.
        max_target_norm: largest length of target coefficients: sin of the largest tilt.
        cos_recovery: cosine of the recovery angle.
        recovery_slope: 1/(cos(recovery angle) − cos(recovery angle + RECOVERY_BLEND_ANGLE)).
    """

    gain: float
    yaw_gain: float
    max_tilt_rate: float
    max_yaw_rate: float
    max_speed: float
    tilt_rate_weight: float
    speed_weight: float
    max_target_norm: float
    cos_recovery: float
    recovery_slope: float


def make_constants(
    gain: float, yaw_gain: float, limits: Limits, recovery_angle: float = RECOVERY_ANGLE
) -> Constants:
    """Check gains, limits and recovery angle, and compute the constants of a law.

    Args:
        gain: p, 1/s.
        yaw_gain: proportional gain on the heading error, 1/s.
        limits: bounds; see `Limits`.
        recovery_angle: tilt from which the planner rotates towards level, rad; at least
            `limits.max_tilt`, at most 80°. Without `limits.max_tilt` this is also the largest tilt
            of a target.

    Raises:
        TypeError: `limits` is not a `Limits`.
        ValueError: a gain or the recovery angle is out of range.
    """
    if not isinstance(limits, Limits):
        raise TypeError(f"limits must be a companion.attitude.Limits, not {limits!r}")
    if not SMALLEST_LIMIT <= gain < inf:
        raise ValueError(f"gain must be at least {SMALLEST_LIMIT:g} 1/s and finite, not {gain}")
    if not 0.0 <= yaw_gain < inf:
        raise ValueError(f"yaw_gain must be finite and not negative, not {yaw_gain}")
    if not 0.0 < recovery_angle <= radians(80.0):
        raise ValueError(f"recovery_angle must be in (0, 80°], not {recovery_angle} rad")
    max_tilt = recovery_angle if limits.max_tilt is None else limits.max_tilt
    if max_tilt > recovery_angle:
        raise ValueError(
            f"max_tilt {max_tilt:.4g} rad must not exceed recovery_angle {recovery_angle:.4g} rad"
        )
    max_speed = limits.coefficient_speed
    return Constants(
        gain=gain,
        yaw_gain=yaw_gain,
        max_tilt_rate=limits.tilt_rate,
        max_yaw_rate=limits.yaw_rate,
        max_speed=max_speed,
        tilt_rate_weight=limits.tilt_rate**-2,
        speed_weight=max_speed**-2,
        max_target_norm=sin(max_tilt),
        cos_recovery=cos(recovery_angle),
        recovery_slope=1.0 / (cos(recovery_angle) - cos(recovery_angle + RECOVERY_BLEND_ANGLE)),
    )
