"""The deadman: nothing fresh to fly by, so nothing is sent, and that for too long."""

from companion.flight.safety.monitor import Judge
from companion.flight.safety.snapshot import Control, Snapshot

_HEARD = 0.3
"""Nothing at all from the vehicle for this long, s: it would not be heard taking over, either."""


def silence(limit: float, *, heard: bool) -> Judge:
    """No setpoint left for longer than `limit` s, while the vehicle is `heard` or is not."""

    def judge(snapshot: Snapshot, _: bool) -> str | None:
        now, control = snapshot.now, snapshot.control
        if now - control.answered <= limit or (now - control.heard < _HEARD) is not heard:
            return None
        return _why(now, control, limit)

    return judge


def _why(now: float, control: Control, limit: float) -> str:
    if now - control.sampled > limit:
        return f"no attitude from the vehicle for {now - control.sampled:.1f} s"
    if now - control.newer > limit:
        return "the vehicle's clock stands still"
    if now - control.fresh > limit:
        return "attitude arrives later than deadman.telemetry_stale_ms"
    if now - control.commanded > limit:
        return _why_no_command(now, control, limit)
    if control.held_back:
        return "after a gap in telemetry the autopilot did not confirm offboard"
    return "attitude from the vehicle cannot be used, or setpoints cannot leave"


def _why_no_command(now: float, control: Control, limit: float) -> str:
    if now - control.placed > limit:
        return "no position from the vehicle"
    if not control.position_fresh:
        return "position arrives later than deadman.position_stale_ms"
    return "guidance makes no commands any more"
