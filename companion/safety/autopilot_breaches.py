"""Checks of the autopilot's own status: arming, failsafe, battery, GPS and estimator.

The docstring of each check states its breach.
"""

from math import degrees

from companion.safety.actions import DISARMED_IN_FLIGHT
from companion.safety.monitor import BreachCheck, above
from companion.safety.snapshot import Snapshot
from companion.vehicle.records import gps_fault, is_outdated

ATTITUDE_FLAG, VELOCITY_FLAGS = 0x1, 0x2 | 0x4
HORIZONTAL_POSITION_FLAGS = 0x8 | 0x10
"""Bits of ESTIMATOR_STATUS_FLAGS. The horizontal position is valid if either of its bits is set."""


def disarmed(snapshot: Snapshot, _: bool) -> str | None:
    """The vehicle is disarmed, and not by `companion`: phases that disarm are not monitored."""
    return None if snapshot.autopilot.armed else DISARMED_IN_FLIGHT


def landed(snapshot: Snapshot, _: bool) -> str | None:
    """The autopilot reports landed in offboard: its land detector or the sent thrust is wrong."""
    return "the autopilot says that it has landed" if snapshot.autopilot.landed else None


def failsafe(snapshot: Snapshot, _: bool) -> str | None:
    """HEARTBEAT's system_status is that of a failsafe: critical, emergency or termination."""
    return "the autopilot reports a failsafe" if snapshot.autopilot.failsafe else None


def battery(min_charge: float) -> BreachCheck:
    """The battery's remaining charge is below `min_charge` (0..1), or is no longer reported.

    A vehicle that never reported a charge is flown without this monitor.
    """

    def check(snapshot: Snapshot, _: bool) -> str | None:
        newest = snapshot.autopilot.battery
        if newest is None:
            return None
        # The battery may have become empty since the last message.
        if is_outdated(newest.received, snapshot.now):
            return "the battery's state is not reported any more"
        if newest.remaining is None:
            charge_received = newest.charge_received
            if charge_received is None or not is_outdated(charge_received, snapshot.now):
                return None
            return "the battery's charge is not reported any more"
        if newest.remaining >= min_charge:
            return None
        return (
            f"battery at {100 * newest.remaining:.0f} %, below "
            f"limits.min_battery_percent = {100 * min_charge:.0f}"
        )

    return check


def gps(snapshot: Snapshot, _: bool) -> str | None:
    """A vehicle that had a 3D GPS fix has lost it, or no longer reports GPS."""
    return gps_fault(snapshot.autopilot.gps, snapshot.now) if snapshot.had_gps else None


def estimator_flags(snapshot: Snapshot, _: bool) -> str | None:
    """The estimator's status lost flags that it had when control began, or is no longer received.

    Only the flags of attitude, velocity and horizontal position count.
    """
    estimator, start_flags = snapshot.autopilot.estimator, snapshot.initial_estimator_flags
    if estimator is None:
        return None
    if is_outdated(estimator.received, snapshot.now):
        return "the estimator's state is not reported any more"
    quantities = ("attitude", ATTITUDE_FLAG), ("velocity", VELOCITY_FLAGS)
    lost = [name for name, bits in quantities if start_flags & bits & ~estimator.flags]
    if start_flags & HORIZONTAL_POSITION_FLAGS and not estimator.flags & HORIZONTAL_POSITION_FLAGS:
        lost.append("position")
    return f"the estimator reports no valid {', '.join(lost)} any more" if lost else None


def any_estimator_reset(snapshot: Snapshot, _: bool) -> str | None:
    """The estimator was reset in the last 30 s; each reset shifts the references, too."""
    resets = snapshot.resets
    if resets.recent_count == 0:
        return None
    return (
        f"the estimator was reset: {resets.position_shift:.1f} m and "
        f"{degrees(resets.heading_shift):.0f}° of heading in total; the references were moved by "
        "the same amount"
    )


def heading_drift(limit: float) -> BreachCheck:
    """The estimated heading turned by more than `limit`, rad, in 20 s; the vehicle did not turn."""
    return above(
        limit,
        lambda snapshot: snapshot.resets.heading_drift,
        lambda drift: (
            f"the heading changed by {degrees(drift):.0f}° in 20 s, and the body rates show no "
            "such turn: the compass or the estimator is wrong"
        ),
    )


def height_contradiction(limit: float) -> BreachCheck:
    """The height changed by more than `limit`, m, in 3 s; the vertical speed does not show it."""
    return above(
        limit,
        lambda snapshot: snapshot.resets.height_contradiction,
        lambda change: (
            f"the height changed by {change:.1f} m in 3 s, and the vertical speed shows no such "
            "motion: the barometer or the estimator is wrong"
        ),
    )


def too_many_estimator_resets(max_count: int, max_shift: float, max_heading: float) -> BreachCheck:
    """The estimator was reset more than `max_count` times within 30 s, or too far in this flight.

    Too far: position jumps of more than `max_shift` (m) in total, heading jumps of more than
    `max_heading` (rad) in total, or one jump of the thrust axis by more than half of `max_heading`.
    """

    def check(snapshot: Snapshot, _: bool) -> str | None:
        resets = snapshot.resets
        if resets.position_shift > max_shift:
            excess = (
                f"by {resets.position_shift:.1f} m, more than safety.max_reset_m = {max_shift:g}"
            )
        elif abs(resets.heading_shift) > max_heading:
            excess = (
                f"by {degrees(abs(resets.heading_shift)):.0f}° of heading, more than "
                f"safety.max_reset_deg = {degrees(max_heading):g}"
            )
        elif resets.largest_tilt_jump > 0.5 * max_heading:
            excess = (
                f"by {degrees(resets.largest_tilt_jump):.0f}° of tilt, more than half of "
                f"safety.max_reset_deg = {degrees(max_heading):g}"
            )
        elif resets.recent_count > max_count:
            excess = (
                f"{resets.recent_count} times within 30 s, more than "
                f"safety.max_resets = {max_count}"
            )
        else:
            return None
        return f"the autopilot's estimator was reset {excess}"

    return check
