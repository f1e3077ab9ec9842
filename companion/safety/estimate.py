"""Whether the autopilot still knows where it is, and how it stands."""

from math import degrees

from companion.safety.monitor import Judge
from companion.safety.snapshot import Snapshot
from companion.vehicle.records import gps_fault, outdated

ATTITUDE, VELOCITY = 0x1, 0x2 | 0x4
HORIZONTAL = 0x8 | 0x10
"""Of ESTIMATOR_STATUS_FLAGS: either of these two tells a horizontal position."""


def gps(snapshot: Snapshot, _: bool) -> str | None:
    """A vehicle that flew by GPS has lost it, or does not tell of it any more."""
    return gps_fault(snapshot.autopilot.gps, snapshot.now) if snapshot.had_gps else None


def flags(snapshot: Snapshot, _: bool) -> str | None:
    """ESTIMATOR_STATUS has lost what it had when control began, or does not come any more."""
    estimator, good = snapshot.autopilot.estimator, snapshot.good_flags
    if estimator is None:
        return None
    if outdated(estimator.received, snapshot.now):
        return "the estimator's state is not reported any more"
    missing = good & (ATTITUDE | VELOCITY) & ~estimator.flags
    if good & HORIZONTAL and not estimator.flags & HORIZONTAL:
        missing |= good & HORIZONTAL
    if not missing:
        return None
    return f"the estimator is not sure any more (ESTIMATOR_STATUS lost flags 0x{missing:x})"


def reset(snapshot: Snapshot, _: bool) -> str | None:
    """The estimator was reset; what is flown has moved along, so this is but told."""
    found = snapshot.resets
    if found.recent == 0:
        return None
    return (
        f"the estimator was reset: {found.shift:.1f} m and {degrees(found.turn):.0f}° of heading "
        "in sum; what is flown moved along"
    )


def resets(most: int, shift: float, turn: float) -> Judge:
    """The estimator was reset too often, or by too much: m, rad."""

    def judge(snapshot: Snapshot, _: bool) -> str | None:
        found = snapshot.resets
        if found.shift > shift:
            return f"the autopilot's estimator was reset by {found.shift:.1f} m"
        if abs(found.turn) > turn:
            return (
                f"the autopilot's estimator was reset by {degrees(abs(found.turn)):.0f}° of heading"
            )
        if found.tilt > 0.5 * turn:
            return f"the autopilot's estimator was reset by {degrees(found.tilt):.0f}° of tilt"
        if found.recent > most:
            return f"the autopilot's estimator was reset {found.recent} times in a short while"
        return None

    return judge
