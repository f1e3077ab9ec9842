"""Checks of the motion: tilt, body rates, speed, tracking error, thrust, and the fence.

The docstring of each check states its breach.

The check `braking` reports a breach before the vehicle leaves the fence. `Fence.stopping_point`
predicts where the vehicle would stop if a present acceleration lasted for the reaction time and the
vehicle then braked with `safety.braking_m_s2`, or with less if tilt limit and wind allow no more.
"""

from math import degrees, hypot

from companion.attitude.kinematics import tilt_angle
from companion.guidance.fence import Fence
from companion.safety.monitor import BreachCheck, above
from companion.safety.snapshot import Snapshot


def tilt(limit: float) -> BreachCheck:
    """The thrust axis tilts more than `limit`, rad."""

    def angle(snapshot: Snapshot) -> float | None:
        q = snapshot.motion.q
        return None if q is None else tilt_angle(q[1], q[2])

    return above(
        limit,
        angle,
        lambda angle: (
            f"the vehicle tilts by {degrees(angle):.0f}°, more than limits.max_tilt_deg + "
            f"safety.tilt_margin_deg = {degrees(limit):.0f}"
        ),
    )


def body_rate(limit: float) -> BreachCheck:
    """The magnitude of the body rates exceeds `limit`, rad/s."""
    return above(
        limit,
        lambda snapshot: hypot(*snapshot.motion.body_rates),
        lambda rate: (
            f"the vehicle turns at {degrees(rate):.0f}°/s, faster than "
            f"safety.max_body_rate_deg_s = {degrees(limit):.0f}"
        ),
    )


def speed(limit: float) -> BreachCheck:
    """The vehicle moves faster than `limit`, m/s."""
    return above(
        limit,
        lambda snapshot: hypot(*snapshot.motion.velocity),
        lambda speed: (
            f"the vehicle flies at {speed:.1f} m/s, faster than safety.max_speed_m_s = {limit:g}"
        ),
    )


def tracking(limit: float) -> BreachCheck:
    """The vehicle is farther than `limit` from its reference, m."""
    return above(
        limit,
        lambda snapshot: snapshot.motion.tracking_error,
        lambda error: (
            f"the vehicle is {error:.1f} m from its reference, more than "
            f"safety.max_tracking_error_m = {limit:g}"
        ),
    )


def thrust(lowest: float, highest: float) -> BreachCheck:
    """The sent thrust is at one of its limits (0..1), so the height may not be held any more."""

    def check(snapshot: Snapshot, _: bool) -> str | None:
        sent = snapshot.motion.thrust
        if sent is None or lowest < sent < highest:
            return None
        limit_name, limit = ("min", lowest) if sent <= lowest else ("max", highest)
        return f"thrust is at limits.{limit_name}_thrust = {limit:g}"

    return check


def outside(fence: Fence) -> BreachCheck:
    """The vehicle is outside the fence.

    A vehicle of unknown latitude and longitude counts as outside a fence in these coordinates.
    """

    def check(snapshot: Snapshot, _: bool) -> str | None:
        motion = snapshot.motion
        if motion.offset is None:
            return None
        breach = fence.breach(motion.offset, motion.height, motion.origin)
        return None if breach is None else str(breach)

    return check


def braking(fence: Fence) -> BreachCheck:
    """The vehicle is inside the fence, but would stop outside if it began to brake now."""

    def check(snapshot: Snapshot, _: bool) -> str | None:
        motion = snapshot.motion
        offset, velocity, height = motion.offset, motion.velocity, motion.height
        if offset is None or fence.breach(offset, height, motion.origin) is not None:
            return None
        breach = fence.breach_at_stopping_point(
            offset,
            velocity,
            height,
            motion.origin,
            acceleration=motion.acceleration,
            wind=motion.wind,
        )
        return None if breach is None else f"braking now would end {breach}"

    return check
