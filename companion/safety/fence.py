"""Whether the vehicle stays inside its fence, and would if it began to brake now.

It is stopped in time: what counts is where it would come to a stop, after the time in which nothing
happens yet, with the deceleration that is certain (`Fence.stop`).
"""

from companion.guidance.fence import Fence
from companion.safety.monitor import Judge
from companion.safety.snapshot import Snapshot


def outside(fence: Fence) -> Judge:
    """The vehicle has left the fence."""

    def judge(snapshot: Snapshot, _: bool) -> str | None:
        motion = snapshot.motion
        if motion.offset is None:
            return None
        found = fence.breach(motion.offset, motion.height, motion.origin)
        return None if found is None else str(found)

    return judge


def braking(fence: Fence) -> Judge:
    """The vehicle is inside, and would not be any more if it began to brake now."""

    def judge(snapshot: Snapshot, _: bool) -> str | None:
        motion = snapshot.motion
        offset, velocity, height = motion.offset, motion.velocity, motion.height
        if offset is None or fence.breach(offset, height, motion.origin) is not None:
            return None
        found = fence.stop_breach(offset, velocity, height, motion.origin)
        return None if found is None else f"about to stop {found}"

    return judge
