"""The limits of clients' motions, and the changes that are refused while a client is in control."""

from math import atan2, degrees, sqrt

from companion.config import Config
from companion.config.in_flight import differences
from companion.guidance import GRAVITY
from companion.serve.setpoints.motion import CommandedMotion, MotionLimits

_MOTION_LIMITS = frozenset(
    {"limits.max_climb_m_s", "limits.max_descent_m_s", "limits.max_yaw_rate_deg_s"}
)
"""Configuration keys of the limits that `CommandedMotion` is given once, when control begins."""

_SPEED_SHARE = 0.9
"""Share of safety.max_speed_m_s that a commanded velocity may reach; the rest is for overshoot."""


def _commanded_speed(config: Config) -> float:
    """Largest horizontal speed of a commanded velocity, m/s.

    The monitor `speed`, which ends a client's control, counts the vertical speed, too.
    """
    max_speed = _SPEED_SHARE * config.safety.max_speed_m_s
    vertical = max(config.limits.max_climb_m_s, config.limits.max_descent_m_s)
    return max(sqrt(max(max_speed**2 - vertical**2, 0.0)), 0.5 * max_speed)


def commanded_motion(config: Config) -> CommandedMotion:
    """The motion that clients command, within the limits of `serve` and `limits`."""
    serve, limits = config.serve, config.limits
    return CommandedMotion(
        MotionLimits(
            serve.max_speed_m_s,
            serve.max_acceleration_m_s2,
            serve.max_jerk_m_s3,
            limits.max_climb_m_s,
            limits.max_descent_m_s,
            limits.max_yaw_rate,
            serve.setpoint_timeout,
            _commanded_speed(config),
        )
    )


def change_refusal(before: Config, after: Config) -> str | None:
    """Why a change is refused while a client is in control; None: it is permitted.

    Motions are planned with the limits at the takeover, but the guidance loop uses changed limits
    at once. With lower limits the vehicle could not follow the motions. So the limits of motions
    must not change, and the tilt limit must stay large enough for these motions.
    """
    changed_names = {each.name for each in differences(before, after)} & _MOTION_LIMITS
    if changed_names:
        return f"{', '.join(sorted(changed_names))} must not change while a client is in control"
    needed_tilt = atan2(after.serve.max_acceleration_m_s2, GRAVITY)
    if after.limits.max_tilt < min(needed_tilt, before.limits.max_tilt):
        return (
            f"limits.max_tilt_deg {after.limits.max_tilt_deg:g} is less than the "
            f"{degrees(needed_tilt):.1f}° that serve.max_acceleration_m_s2 needs"
        )
    return None
