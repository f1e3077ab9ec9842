"""Whether the vehicle moves as it was meant to: tilt, rates, speed, course, thrust."""

from math import degrees, hypot

from companion.attitude.kinematics import tilt_angle
from companion.safety.monitor import Judge, released
from companion.safety.snapshot import Snapshot


def tilt(limit: float) -> Judge:
    """The thrust axis leans farther than `limit`, rad."""

    def judge(snapshot: Snapshot, raised: bool) -> str | None:
        q = snapshot.motion.q
        if q is None:
            return None
        lean = tilt_angle(q[1], q[2])
        return f"{degrees(lean):.0f}° of tilt" if lean > released(limit, raised) else None

    return judge


def body_rate(limit: float) -> Judge:
    """The body turns faster than `limit` about any axis, rad/s."""

    def judge(snapshot: Snapshot, raised: bool) -> str | None:
        rate = hypot(*snapshot.motion.body_rates)
        if rate <= released(limit, raised):
            return None
        return f"the vehicle turns at {degrees(rate):.0f}°/s"

    return judge


def speed(limit: float) -> Judge:
    """The vehicle moves faster than `limit`, m/s."""

    def judge(snapshot: Snapshot, raised: bool) -> str | None:
        fast = hypot(*snapshot.motion.velocity)
        if fast <= released(limit, raised):
            return None
        return f"{fast:.1f} m/s, faster than safety.max_speed_m_s"

    return judge


def tracking(limit: float) -> Judge:
    """The vehicle is farther than `limit` from where it ought to be, m."""

    def judge(snapshot: Snapshot, raised: bool) -> str | None:
        error = snapshot.motion.off_course
        if error is None or error <= released(limit, raised):
            return None
        return f"{error:.1f} m off its course, more than safety.max_tracking_error_m"

    return judge


def thrust(lowest: float, highest: float) -> Judge:
    """The thrust stands at one of its limits: height is not held any more."""

    def judge(snapshot: Snapshot, _: bool) -> str | None:
        sent = snapshot.motion.thrust
        if sent is None or lowest < sent < highest:
            return None
        key = "min_thrust" if sent <= lowest else "max_thrust"
        return f"thrust stands at limits.{key}"

    return judge
