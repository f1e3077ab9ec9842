"""Offboard loss of our own: nothing fresh to fly by, so nothing is sent, for too long."""

from companion.control.loop_record import Unanswered
from companion.safety.monitor import Judge
from companion.safety.snapshot import Control, Snapshot

_HEARD = 0.3
"""Nothing at all from the vehicle for this long, s: it would not be heard taking over, either."""

_OURS = 0.5
"""Beyond this share of the silence it is of our own making."""


def silence(limit: float, *, heard: bool) -> Judge:
    """No setpoint left for longer than `limit` s, while the vehicle is `heard` or is not."""

    def judge(snapshot: Snapshot, _: bool) -> str | None:
        now, control = snapshot.now, snapshot.control
        if now - control.answered <= limit or (now - control.heard < _HEARD) is not heard:
            return None
        return _why(now, control, limit)

    return judge


def _why(now: float, control: Control, limit: float) -> str:
    if control.stood_still > _OURS * (now - control.answered):
        # What came meanwhile was read late, and nobody could notice that it came in time.
        return f"this computer stood still for {control.stood_still:.1f} s"
    if now - control.sampled > limit:
        return f"no attitude from the vehicle for {now - control.sampled:.1f} s"
    reason = control.reason
    if reason in (Unanswered.NO_TARGET, Unanswered.OLD_TARGET):
        return _why_no_command(now, control, limit)
    return "no setpoint was sent" if reason is None else reason.words


def _why_no_command(now: float, control: Control, limit: float) -> str:
    if now - control.placed > limit:
        return "no position from the vehicle"
    if not control.position_fresh:
        return "position arrives later than deadman.position_stale_ms"
    return Unanswered.OLD_TARGET.words


def clock_changed(snapshot: Snapshot, _: bool) -> str | None:
    """The vehicle's clock jumped, stood still, wrapped or restarted since control began."""
    return snapshot.control.clock_change
