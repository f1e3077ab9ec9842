"""The configured maneuvers, made and checked before the flight."""

from dataclasses import replace

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
from companion.flight.trajectory_notes import overview, slow_down_notes
from companion.guidance import Corners, Doublets, Maneuver, ManeuverSequence, Steps
from companion.guidance.follow import Follow, circle, hover
from companion.guidance.trajectory import slow_down, violations


def configured_maneuvers(config: Config, drag: KnownDrag | None = None) -> ManeuverSequence:
    """The sequence of maneuvers from `flight.maneuvers`, checked against limits and fence.

    `drag`: drag of the vehicle; None: drag of the vehicle that flew last. A flight checks again
    with the vehicle's own drag as soon as it is known (`maneuver_checks.require_still_flyable`).

    Raises:
        ConfigError: a trajectory cannot be read, or a maneuver cannot be flown within the limits
            and the fence.
    """
    drag = drag or drag_before_connecting(config)
    return ManeuverSequence([_maneuver(config, name, drag) for name in config.flight.maneuvers])


def fresh_copy(sequence: ManeuverSequence) -> ManeuverSequence:
    """A copy of the sequence that has not begun: a `Follow` stores the pose where it began."""
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
        elif found_violations := violations(trajectory, envelope):
            first_violation = min(found_violations, key=lambda one: one.slowing_helps)
            assumption = drag.assumption if first_violation.slowing_helps else ""
            raise ConfigError(f"{path}: {first_violation}; {first_violation.remedy}{assumption}")
    notes = (*notes, overview(trajectory))
    return Follow(trajectory, config.limits.max_yaw_rate, notes)
