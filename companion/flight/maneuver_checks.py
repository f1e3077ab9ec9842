"""Checks of maneuvers against limits and fence, with the known drag of the vehicle."""

from collections.abc import Hashable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import lru_cache
from math import atan, tau
from pathlib import Path

import numpy as np

from companion.config import Config
from companion.config.known_drag import KnownDrag
from companion.control.inner_loop import full_thrust, thrust_limits
from companion.drag import Drag
from companion.files.yaml_file import ConfigError
from companion.flight.fence_check import FenceCheck
from companion.guidance import GRAVITY, Doublets, Maneuver, ManeuverSequence
from companion.guidance.fence import LatLon
from companion.guidance.follow import Follow, HeldHeadingManeuver
from companion.guidance.predicted import predict
from companion.guidance.reference import Vector
from companion.guidance.trajectory import (
    Envelope,
    Motion,
    Trajectory,
    TrajectoryError,
    Violation,
    motion_violations,
    slow_down,
    violations,
)
from companion.safety.table import fence_of

_SLOWER_REMEDY = "make it slower or smaller, or change the limit"
_SLOWER_IN_PROGRAM = (
    "fly it more slowly (follow: slow_down=True; go_to: a lower speed, acceleration or jerk), or "
    "change the limit"
)


def require_flyable(config: Config, maneuver: Maneuver, drag: KnownDrag) -> None:
    """Check a maneuver other than a trajectory against the fence; a circle also against limits.

    Raises:
        ConfigError: the maneuver cannot be flown within the limits and the fence.
    """
    with naming_trajectory_errors(maneuver.name):
        motions = list(_predicted_motions(maneuver, drag.lower_bound))
        _require_motions_inside(config, maneuver, motions, None)
    if isinstance(maneuver, HeldHeadingManeuver):
        envelope = replace(envelope_of(config, drag), max_tilt_rate=None, fence=None)
        for violation in motion_violations(motions[0], envelope):
            _refuse_violation(maneuver.name, violation, drag.assumption)


def require_inside(
    config: Config, maneuvers: Iterable[Maneuver], origin: LatLon | None, drag: KnownDrag
) -> None:
    """Check that all maneuvers stay inside the fence, also a fence in latitude and longitude.

    `origin`: geographic position where control begins, or None.

    Raises:
        ConfigError: a maneuver leaves the fence, or could not stop inside it.
    """
    for maneuver in maneuvers:
        _require_motions_inside(
            config, maneuver, _predicted_motions(maneuver, drag.lower_bound), origin
        )


def require_followable(config: Config, maneuver: Maneuver, begin: Vector, drag: KnownDrag) -> None:
    """Check a trajectory that a program flies from the present place against limits and fence.

    `maneuver`: `Follow` or `HeldHeadingManeuver`. `begin`: start of the trajectory relative to
    where control began, m NED.

    Raises:
        ConfigError: the trajectory cannot be computed, or leaves the limits or the fence.
    """
    if isinstance(maneuver, Follow | HeldHeadingManeuver):
        with naming_trajectory_errors(maneuver.name):
            found_violations = violations(maneuver.trajectory, _envelope_from(begin, config, drag))
        if found_violations:
            remedy = (
                _SLOWER_IN_PROGRAM
                if found_violations[0].slowing_helps
                else found_violations[0].remedy
            )
            raise ConfigError(f"{maneuver.name}: {found_violations[0]}; {remedy}")


def slowed_from(
    config: Config, trajectory: Trajectory, begin: Vector, drag: KnownDrag
) -> Trajectory:
    """The trajectory from the present place, slowed down where it breaks a limit.

    Arguments as in `require_followable`.

    Raises:
        ConfigError: the trajectory breaks a limit at any speed, or cannot be computed.
    """
    envelope = with_reserve(config, _envelope_from(begin, config, drag))
    with naming_trajectory_errors(trajectory.name):
        return slow_down(trajectory, envelope).trajectory


def require_still_flyable(config: Config, sequence: ManeuverSequence, drag: KnownDrag) -> None:
    """Check the maneuvers again, because the limits or the vehicle have changed.

    The check uses the trajectory that is flown; it is not read or slowed down again.

    `config`: the changed configuration; its maneuvers are those of `sequence`. `sequence`: the
    maneuvers that were made when the flight began.

    Raises:
        ConfigError: a maneuver cannot be computed, or leaves the limits or the fence.
    """
    for maneuver in sequence.parts:
        if not isinstance(maneuver, Follow):
            require_flyable(config, maneuver, drag)
            continue
        with naming_trajectory_errors(maneuver.name):
            found_violations = violations(maneuver.trajectory, envelope_of(config, drag))
        if found_violations:
            raise ConfigError(
                f"{maneuver.name}: {found_violations[0]}; choose a value with which the trajectory "
                "keeps the limits, because it is not slowed down again in "
                f"flight{drag.assumption}"
            )


@contextmanager
def naming_trajectory_errors(name: str | Path) -> Iterator[None]:
    """Name the maneuver or file in the error of a trajectory that cannot be computed.

    Raises:
        ConfigError: the block raised a `TrajectoryError`.
    """
    try:
        yield
    except TrajectoryError as error:
        raise ConfigError(f"{name}: {error}") from error


def _require_motions_inside(
    config: Config, maneuver: Maneuver, motions: Iterable[Motion], origin: LatLon | None
) -> None:
    """Check predicted motions of a maneuver; see `require_inside`."""
    check = _fence_check(config, origin)
    for motion in motions:
        _refuse_violation(maneuver.name, check(motion))


def _predicted_motions(maneuver: Maneuver, drag: Drag) -> Iterator[Motion]:
    """Predicted motions of a maneuver; for body-rate doublets, at eight initial headings."""
    heading_count = 8 if isinstance(maneuver, Doublets) else 1
    for k in range(heading_count):
        heading = tau * k / heading_count
        # Cached, because a flight checks its maneuvers several times. A `Follow` is not hashable.
        if isinstance(maneuver, Hashable):
            yield _cached_motion(maneuver, heading, drag)
        else:
            yield _predicted_motion(maneuver, heading, drag)


def _predicted_motion(maneuver: Maneuver, heading: float, drag: Drag) -> Motion:
    """The predicted motion of a maneuver that begins at a heading (rad)."""
    times, offset, velocity, acceleration = (
        np.array(column) for column in zip(*predict(maneuver, heading, drag), strict=True)
    )
    jerk, heading_rate = np.zeros_like(offset), np.zeros_like(times)
    return Motion(times, offset, velocity, acceleration, jerk, heading_rate)


_cached_motion = lru_cache(maxsize=32)(_predicted_motion)


def _refuse_violation(name: str, violation: Violation | None, assumption: str = "") -> None:
    if violation is None:
        return
    # `--slow-down` applies to trajectories only.
    remedy = _SLOWER_REMEDY if violation.slowing_helps else violation.remedy
    raise ConfigError(f"{name}: {violation}; {remedy}{assumption}")


def envelope_of(config: Config, drag: KnownDrag) -> Envelope:
    """The limits for a trajectory, relative to where the maneuver begins."""
    limits, (min_thrust, max_thrust) = config.limits, thrust_limits(config)
    return Envelope(
        max_tilt=limits.max_tilt,
        max_tilt_rate=limits.max_tilt_rate,
        max_yaw_rate=limits.max_yaw_rate,
        min_thrust=min_thrust,
        max_thrust=max_thrust,
        full_thrust=full_thrust(config),
        max_climb=limits.max_climb_m_s,
        max_descent=limits.max_descent_m_s,
        max_speed=config.safety.max_speed_m_s,
        fence=_fence_check(config, None),
        drag=drag.upper_bound,
        gravity=GRAVITY,
    )


def _envelope_from(begin: Vector, config: Config, drag: KnownDrag) -> Envelope:
    """The limits for a trajectory that begins at `begin`, m NED from where control began."""
    envelope = envelope_of(config, drag)
    check = envelope.fence
    assert check is not None

    def fence(motion: Motion) -> Violation | None:
        return check(replace(motion, position=motion.position + np.array(begin)))

    return replace(envelope, fence=fence)


def with_reserve(config: Config, envelope: Envelope) -> Envelope:
    """The limits, with a tilt limit lower by `flight.slow_down_reserve_m_s2` of acceleration."""
    max_acceleration = (
        config.limits.max_horizontal_acceleration - config.flight.slow_down_reserve_m_s2
    )
    return replace(envelope, max_tilt=atan(max_acceleration / GRAVITY))


def _fence_check(config: Config, origin: LatLon | None) -> FenceCheck:
    return FenceCheck(fence_of(config), config.flight.takeoff_height_m, origin)
