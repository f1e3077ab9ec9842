"""The configured maneuvers, checked against limits and fence before the flight."""

from collections.abc import Hashable, Iterable, Iterator
from dataclasses import replace
from functools import lru_cache
from math import tau

import numpy as np

from companion.config import Config, trajectory_file
from companion.config.flight import IdentifyConfig
from companion.config.known_drag import assumption, least_drag, most_drag
from companion.control.inner_loop import thrust_limits
from companion.drag import Drag
from companion.files.yaml_file import ConfigError
from companion.flight.fence_check import FenceCheck
from companion.flight.trajectory_notes import overview, slowing
from companion.guidance import (
    GRAVITY,
    Corners,
    Doublets,
    Maneuver,
    ManeuverSequence,
    Steps,
)
from companion.guidance.fence import Place
from companion.guidance.follow import Follow, HeldFigure, circle, hover
from companion.guidance.predicted import predicted
from companion.guidance.reference import Vector
from companion.guidance.trajectory import (
    Envelope,
    Motion,
    TrajectoryError,
    Violation,
    judge,
    slow_down,
    violations,
)
from companion.safety.table import fence_of

_SLOWER = "make it slower or smaller, or change the limit"


def configured_maneuvers(config: Config) -> ManeuverSequence:
    """The sequence of maneuvers from `flight.maneuvers`.

    Raises:
        ConfigError: a trajectory cannot be read, or a maneuver cannot be flown within the limits
            and the fence.
    """
    return ManeuverSequence([_part(config, name) for name in config.flight.maneuvers])


def unbegun(sequence: ManeuverSequence) -> ManeuverSequence:
    """A copy without state: `Follow` remembers the pose where it began."""
    return ManeuverSequence(
        [
            replace(part, _turned=None, _pose=None) if isinstance(part, Follow) else part
            for part in sequence.parts
        ]
    )


def require_inside(config: Config, parts: Iterable[Maneuver], origin: Place | None) -> None:
    """Check that all maneuvers stay inside the fence, a polygon on the map included.

    Args:
        config: of the flight.
        parts: the maneuvers.
        origin: where control begins, or None where unknown.

    Raises:
        ConfigError: a maneuver leaves the fence, or could not stop inside it.
    """
    for part in parts:
        _require_motions_inside(config, part, _motions(part, least_drag(config)), origin)


def require_followable(config: Config, maneuver: Maneuver, begin: Vector) -> None:
    """Check a trajectory that begins in flight against all limits and the fence.

    Args:
        config: of the flight.
        maneuver: `Follow` or `HeldFigure`.
        begin: where it begins, NED from where control began, m.

    Raises:
        ConfigError: it cannot be flown within the limits and the fence.
    """
    envelope = _envelope(config)
    check = envelope.fence
    assert check is not None

    def fence(motion: Motion) -> Violation | None:
        return check(replace(motion, position=motion.position + np.array(begin)))

    if isinstance(maneuver, Follow | HeldFigure):
        broken = violations(maneuver.trajectory, replace(envelope, fence=fence))
        if broken:
            raise ConfigError(f"{maneuver.name}: {broken[0]}; {broken[0].remedy}")


def require_still_flyable(config: Config, flown: ManeuverSequence) -> None:
    """Check the maneuvers of a flight against limits that have changed since it began.

    A trajectory is judged as it is flown: it is neither read nor slowed down again.

    Args:
        config: the changed configuration; its maneuvers are those of `flown`.
        flown: the maneuvers that were made when the flight began.

    Raises:
        ConfigError: a maneuver cannot be flown within the limits and the fence.
    """
    for name, part in zip(config.flight.maneuvers, flown.parts, strict=True):
        if not isinstance(part, Follow):
            _part(config, name)
        elif broken := violations(part.trajectory, _envelope(config)):
            raise ConfigError(f"{part.name}: {broken[0]}; it is flown as it was when it began")


def _part(config: Config, name: str) -> Maneuver:
    if name == "trajectory":
        return _follow(config)
    part = _simple(config, name)
    try:
        motions = list(_motions(part, least_drag(config)))
        _require_motions_inside(config, part, motions, None)
    except TrajectoryError as error:
        raise ConfigError(f"{name}: {error}") from error
    if name == "circle":
        for broken in judge(motions[0], replace(_envelope(config), max_tilt_rate=None, fence=None)):
            _refuse(part.name, broken, assumption(config))
    return part


def _require_motions_inside(
    config: Config, part: Maneuver, motions: Iterable[Motion], origin: Place | None
) -> None:
    """Check predicted motions of a maneuver, as `require_inside`."""
    check = _fence_check(config, origin)
    for motion in motions:
        _refuse(part.name, check(motion))


def _simple(config: Config, name: str) -> Maneuver:
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


def _motions(part: Maneuver, drag: Drag) -> Iterator[Motion]:
    """Predicted motions of a maneuver; for body-rate doublets, at eight initial headings."""
    turns = 8 if isinstance(part, Doublets) else 1
    for k in range(turns):
        heading = tau * k / turns
        # A flight checks its maneuvers several times. `Follow` remembers where it began: not kept.
        if isinstance(part, Hashable):
            yield _kept_motion(part, heading, drag)
        else:
            yield _motion(part, heading, drag)


def _motion(part: Maneuver, heading: float, drag: Drag) -> Motion:
    """The predicted motion of a maneuver that begins at a heading (rad)."""
    times, offset, velocity, acceleration = (
        np.array(column) for column in zip(*predicted(part, heading, drag), strict=True)
    )
    jerk, turning = np.zeros_like(offset), np.zeros_like(times)
    return Motion(times, offset, velocity, acceleration, jerk, turning)


_kept_motion = lru_cache(maxsize=32)(_motion)


def _refuse(name: str, broken: Violation | None, drag: str = "") -> None:
    if broken is None:
        return
    # `--slow-down` applies to trajectories only.
    remedy = _SLOWER if broken.slowing_helps else broken.remedy
    raise ConfigError(f"{name}: {broken}; {remedy}{drag}")


def _doublets(identify: IdentifyConfig) -> Doublets:
    return Doublets(
        tilt_rate=identify.tilt_rate,
        tilt_step=identify.tilt_duration_s,
        yaw_rate=identify.yaw_rate,
        yaw_step=identify.yaw_duration_s,
        climb=identify.climb_m_s2,
        climb_step=identify.climb_duration_s,
        settle=identify.settle_s,
    )


def _follow(config: Config) -> Follow:
    """The trajectory of `flight.trajectory`, slowed down if needed and allowed."""
    path = config.flight.trajectory
    if path is None:
        raise ConfigError("flight.trajectory: name a file, or fly with --trajectory FILE")
    loaded, envelope = trajectory_file.read(path), _envelope(config)
    trajectory = loaded.trajectory
    notes = loaded.notes
    if config.flight.slow_down:
        try:
            slower = slow_down(trajectory, envelope)
        except TrajectoryError as error:
            raise ConfigError(f"{path}: {error}") from error
        notes = (*notes, *slowing(trajectory, slower))
        trajectory = slower.trajectory
    elif broken := violations(trajectory, envelope):
        first = min(broken, key=lambda one: one.slowing_helps)
        drag = assumption(config) if first.slowing_helps else ""
        raise ConfigError(f"{path}: {first}; {first.remedy}{drag}")
    notes = (*notes, overview(trajectory))
    return Follow(trajectory, config.limits.max_yaw_rate, notes)


def _envelope(config: Config) -> Envelope:
    """The limits for a trajectory, relative to where the maneuver begins."""
    limits, (min_thrust, max_thrust) = config.limits, thrust_limits(config)
    return Envelope(
        max_tilt=limits.max_tilt,
        max_tilt_rate=limits.max_tilt_rate,
        max_yaw_rate=limits.max_yaw_rate,
        min_thrust=min_thrust,
        max_thrust=max_thrust,
        max_climb=limits.max_climb_m_s,
        max_descent=limits.max_descent_m_s,
        max_speed=config.safety.max_speed_m_s,
        fence=_fence_check(config, None),
        drag=most_drag(config),
        gravity=GRAVITY,
    )


def _fence_check(config: Config, origin: Place | None) -> FenceCheck:
    return FenceCheck(fence_of(config), config.flight.takeoff_height_m, origin)
