"""The configured maneuvers, made and checked before the flight, with notes about a trajectory."""

from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise
from math import dist
from pathlib import Path

import numpy as np

from companion.config import Config, trajectory_file
from companion.config.flight import IdentifyConfig
from companion.config.known_drag import KnownDrag, drag_before_connecting
from companion.files.yaml_file import ConfigError
from companion.flight.maneuver_checks import (
    envelope_of,
    naming_trajectory_errors,
    require_flyable,
    with_reserve,
)
from companion.guidance import Corners, Doublets, Maneuver, ManeuverSequence, Steps
from companion.guidance.follow import Follow, HeldHeadingManeuver, circle, hover
from companion.guidance.trajectory import SlowDown, SlowedPart, Trajectory, slow_down, violations
from companion.guidance.trajectory.demand import Motion, sampled_motion
from companion.guidance.trajectory.feasibility import TILT_LIMIT, TILT_RATE_LIMIT

_MOST_PARTS_SHOWN = 4
_LARGEST_RETURN_ERROR = 0.5
"""Largest distance from the beginning to the end of a maneuver that another one follows, m."""
_SMOOTHER_REMEDY = (
    "if the table's speed jumps, as at a corner, smooth it more instead: name it in a YAML file "
    "with csv.cutoff_hz: 1 (docs/trajectories.md)"
)
_LIMITS_OF_SMOOTHNESS = (TILT_LIMIT, TILT_RATE_LIMIT)


def configured_maneuvers(config: Config, drag: KnownDrag | None = None) -> ManeuverSequence:
    """The sequence of maneuvers from `flight.maneuvers`, checked against limits and fence.

    `drag`: drag of the vehicle; None: drag of the vehicle that flew last. A flight checks again
    with the vehicle's own drag as soon as it is known (`maneuver_checks.require_still_flyable`).

    Raises:
        ConfigError: a trajectory cannot be read, a maneuver cannot be flown within the limits and
            the fence, or one that ends elsewhere is not the last.
    """
    drag = drag or drag_before_connecting(config)
    maneuvers = [_maneuver(config, name, drag) for name in config.flight.maneuvers]
    for maneuver, next_maneuver in pairwise(maneuvers):
        _require_return(maneuver, next_maneuver)
    return ManeuverSequence(maneuvers)


def _require_return(maneuver: Maneuver, next_maneuver: Maneuver) -> None:
    """Refuse a maneuver that ends elsewhere: the reference would jump back to where it began."""
    if not isinstance(maneuver, Follow | HeldHeadingManeuver):
        return
    trajectory = maneuver.trajectory
    distance = dist(trajectory.at(0.0).position, trajectory.at(trajectory.duration).position)
    if distance > _LARGEST_RETURN_ERROR:
        raise ConfigError(
            f"flight.maneuvers: {maneuver.name} ends {distance:.1f} m from where it begins, but "
            f"{next_maneuver.name} begins there again; put {maneuver.name} last, or let it return"
        )


def fresh_copy(sequence: ManeuverSequence) -> ManeuverSequence:
    """A copy that can begin anew: a `Follow` of the original may store the pose where it began."""
    return ManeuverSequence(
        [
            replace(maneuver, _turned_trajectory=None, _pose=None)
            if isinstance(maneuver, Follow)
            else maneuver
            for maneuver in sequence.parts
        ]
    )


def _maneuver(config: Config, name: str, drag: KnownDrag) -> Maneuver:
    if name == "trajectory":
        return _follow(config, drag)
    maneuver = _simple_maneuver(config, name)
    require_flyable(config, maneuver, drag)
    return maneuver


def _simple_maneuver(config: Config, name: str) -> Maneuver:
    corners, steps = config.corners, config.steps
    match name:
        case "hover":
            return hover(config.hover.duration_s)
        case "steps":
            return Steps(steps.coefficient, steps.duration_s, steps.settle_s)
        case "circle":
            return circle(config.circle.radius_m, config.circle.speed_m_s, config.circle.laps)
        case "corners":
            return Corners(
                corners.north_coefficient,
                corners.east_coefficient,
                corners.duration_s,
                corners.settle_s,
            )
        case _:
            return _doublets(config.identify)


def _doublets(identify: IdentifyConfig) -> Doublets:
    return Doublets(
        tilt_rate=identify.tilt_rate,
        tilt_step_time=identify.tilt_duration_s,
        yaw_rate=identify.yaw_rate,
        yaw_step_time=identify.yaw_duration_s,
        climb_acceleration=identify.climb_m_s2,
        climb_step_time=identify.climb_duration_s,
        settle_time=identify.settle_s,
    )


def _follow(config: Config, drag: KnownDrag) -> Follow:
    """The trajectory of `flight.trajectory`, slowed down if needed and allowed."""
    path = config.flight.trajectory
    if path is None:
        raise ConfigError("flight.trajectory: name a file, or fly with --trajectory FILE")
    loaded, envelope = trajectory_file.read(path), envelope_of(config, drag)
    trajectory = loaded.trajectory
    notes = loaded.notes
    with naming_trajectory_errors(path):
        if config.flight.slow_down:
            slower = slow_down(trajectory, with_reserve(config, envelope))
            reserve = config.flight.slow_down_reserve_m_s2
            notes = (*notes, *slow_down_notes(trajectory, slower, reserve))
            trajectory = slower.trajectory
            if _is_rough_table(path, [part.limit for part in slower.parts]):
                notes = (*notes, f"{trajectory.name}: {_SMOOTHER_REMEDY}")
        elif found_violations := violations(trajectory, envelope):
            first_violation = min(found_violations, key=lambda one: one.slowing_helps)
            assumption = drag.assumption if first_violation.slowing_helps else ""
            text = f"{path}: {first_violation}; {first_violation.remedy}{assumption}"
            is_rough = _is_rough_table(path, [first_violation.limit])
            raise ConfigError(f"{text}; {_SMOOTHER_REMEDY}" if is_rough else text)
    notes = (*notes, overview(trajectory))
    return Follow(trajectory, config.limits.max_yaw_rate, notes)


def _is_rough_table(path: Path, broken_limits: Iterable[str]) -> bool:
    """Whether more smoothing than by the default may keep the limits that a trajectory breaks."""
    return trajectory_file.is_table(path) and not set(_LIMITS_OF_SMOOTHNESS).isdisjoint(
        broken_limits
    )


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
    if more_count > 0:
        parts += f"; and in {more_count} more {'part' if more_count == 1 else 'parts'}"
    return f"{before.name} is slowed down to keep its limits: {parts}", result


def _tightest_limit(trajectory: Trajectory, part: SlowedPart, reserve: float) -> str:
    north, east, down = trajectory.at(part.time).position
    reserve_text = ""
    if reserve and part.limit == TILT_LIMIT:
        reserve_text = f" (minus flight.slow_down_reserve_m_s2: {reserve:g})"
    return (
        f"{part.limit or 'a limit'}{reserve_text} at {part.time:.1f} s "
        f"({north:z.1f} m north, {east:z.1f} m east, {-down:z.1f} m up)"
    )


def _largest_speed(motion: Motion) -> float:
    return float(np.linalg.norm(motion.velocity, axis=1).max())


def _range_text(low: float, high: float) -> str:
    low, high = round(low, 1) + 0.0, round(high, 1) + 0.0  # no "-0.0"
    return f"{low:.1f} to {high:.1f}"
