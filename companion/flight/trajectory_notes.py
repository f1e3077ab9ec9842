"""Messages to the user about a trajectory: its size, what was slowed down, and why."""

import numpy as np

from companion.guidance.trajectory import SlowDown, SlowedPart, Trajectory
from companion.guidance.trajectory.demand import Motion, sampled_motion
from companion.guidance.trajectory.feasibility import TILT_LIMIT

_MOST_PARTS_SHOWN = 4


def overview(trajectory: Trajectory) -> str:
    """One sentence: duration, largest speed and extent of the trajectory."""
    motion = sampled_motion(trajectory)
    speed = _largest_speed(motion)
    lows, highs = motion.position.min(axis=0), motion.position.max(axis=0)
    north, east = (_range_text(low, high) for low, high in zip(lows[:2], highs[:2], strict=True))
    return (
        f"{trajectory.name}: {trajectory.duration:.1f} s, at most {speed:.2f} m/s; from "
        f"its start {north} m north, {east} m east, {_range_text(-highs[2], -lows[2])} m up"
    )


def slow_down_notes(before: Trajectory, slow_down: SlowDown, reserve: float) -> tuple[str, ...]:
    """Messages for the user: where the trajectory was slowed down, and for which limit.

    There are no messages if the trajectory was not slowed down.

    Args:
        before: the trajectory before it was slowed down.
        slow_down: the slowed-down trajectory, and its slowed parts.
        reserve: horizontal acceleration that was left below the tilt limit, m/s².
    """
    if not slow_down.parts:
        return ()
    after = slow_down.trajectory
    speed, speed_before = (_largest_speed(sampled_motion(each)) for each in (after, before))
    slowed, unslowed = f"{speed:.2f} m/s", f"{speed_before:.2f} m/s"
    result = (
        f"{before.name} now lasts {after.duration:.1f} s instead of {before.duration:.1f} s, and "
        f"its highest speed is "
        + (f"still {slowed}" if slowed == unslowed else f"{slowed} instead of {unslowed}")
    )
    if slow_down.is_even:
        (whole_part,) = slow_down.parts
        note = (
            f"{before.name} is slowed down evenly, by a factor of {whole_part.factor:.2f}, because "
            f"{slow_down.reason}; its tightest limit is "
            f"{_tightest_limit(after, whole_part, reserve)}"
        )
        return note, result
    parts = "; ".join(
        f"from {part.begin:.1f} to {part.end:.1f} s by a factor of up to {part.factor:.2f}, "
        f"because of {_tightest_limit(after, part, reserve)}"
        for part in slow_down.parts[:_MOST_PARTS_SHOWN]
    )
    more_count = len(slow_down.parts) - _MOST_PARTS_SHOWN
    parts += f"; and in {more_count} more parts" if more_count > 0 else ""
    return f"{before.name} is slowed down to keep its limits: {parts}", result


def _tightest_limit(trajectory: Trajectory, part: SlowedPart, reserve: float) -> str:
    north, east, down = trajectory.at(part.time).position
    reserve_text = ""
    if reserve and part.limit == TILT_LIMIT:
        reserve_text = f" (less flight.slow_down_reserve_m_s2: {reserve:g})"
    return (
        f"{part.limit or 'a limit'}{reserve_text} at {part.time:.1f} s "
        f"({north:.1f} m north, {east:.1f} m east, {0.0 - down:.1f} m up)"
    )


def _largest_speed(motion: Motion) -> float:
    return float(np.linalg.norm(motion.velocity, axis=1).max())


def _range_text(low: float, high: float) -> str:
    low, high = round(low, 1) + 0.0, round(high, 1) + 0.0  # no "-0.0"
    return f"{low:.1f} to {high:.1f}"
