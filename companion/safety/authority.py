"""Whose vehicle it is, by what the autopilot says of itself."""

from companion.safety.snapshot import Snapshot


def disarmed(snapshot: Snapshot, _: bool) -> str | None:
    """The motors were stopped, and not by us."""
    return None if snapshot.autopilot.armed else "the vehicle disarmed in flight"


def landed(snapshot: Snapshot, _: bool) -> str | None:
    """What flies by our thrust cannot have landed: the land detector is wrong, or the thrust is."""
    return "the autopilot says that it has landed" if snapshot.autopilot.landed else None


def failsafe(snapshot: Snapshot, _: bool) -> str | None:
    """HEARTBEAT's system_status is MAV_STATE_CRITICAL."""
    return "the autopilot reports a failsafe" if snapshot.autopilot.failsafe else None
