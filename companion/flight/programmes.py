"""The programmes that the configuration asks for, checked before anything flies."""

from dataclasses import replace
from math import radians

from companion import trajectory_file
from companion.config import Config
from companion.config_programmes import IdentifyConfig
from companion.flight.follow import Follow
from companion.flight.outer_loop import thrust_limits
from companion.guidance import (
    GRAVITY,
    Circle,
    Corners,
    Doublets,
    Hover,
    Programme,
    Sequence,
    Steps,
)
from companion.trajectory import Envelope, TrajectoryError, slow_down, violations
from companion.yaml_file import ConfigError


def programme(config: Config) -> Sequence:
    """The programmes of `flight.programme`, one after the other.

    Raises:
        ConfigError: the trajectory cannot be read, or cannot be flown within the limits.
    """
    return Sequence([_part(config, name) for name in config.flight.programme])


def unbegun(sequence: Sequence) -> Sequence:
    """The same, as if nobody had asked it for a reference yet: `Follow` keeps where it began."""
    return Sequence(
        [
            replace(part, _turned=None, _pose=None) if isinstance(part, Follow) else part
            for part in sequence.parts
        ]
    )


def _part(config: Config, name: str) -> Programme:
    corners, steps, circle = config.corners, config.steps, config.circle
    match name:
        case "hover":
            return Hover(config.hover.duration_s)
        case "steps":
            return Steps(steps.coefficient, steps.duration_s, steps.settle_s)
        case "circle":
            return Circle(circle.radius_m, circle.speed_m_s, circle.laps)
        case "corners":
            return Corners(
                corners.north_coefficient,
                corners.east_coefficient,
                corners.duration_s,
                corners.settle_s,
            )
        case "identify":
            return _doublets(config.identify)
        case _:
            return _follow(config)


def _doublets(identify: IdentifyConfig) -> Doublets:
    return Doublets(
        tilt_rate=radians(identify.tilt_rate_deg_s),
        tilt_step=identify.tilt_duration_s,
        yaw_rate=radians(identify.yaw_rate_deg_s),
        yaw_step=identify.yaw_duration_s,
        climb=identify.climb_m_s2,
        climb_step=identify.climb_duration_s,
        settle=identify.settle_s,
    )


def _follow(config: Config) -> Follow:
    """The trajectory of `flight.trajectory`, slowed down if it has to be and may be."""
    path = config.flight.trajectory
    if path is None:
        raise ConfigError("flight.trajectory: name a file, or fly with --trajectory FILE")
    trajectory, envelope = trajectory_file.load(path), _envelope(config)
    factor = 1.0
    if config.flight.slow_down:
        try:
            trajectory, factor = slow_down(trajectory, envelope)
        except TrajectoryError as error:
            raise ConfigError(f"{path}: {error}") from error
    elif broken := violations(trajectory, envelope):
        raise ConfigError(
            f"{path}: {broken[0]}; fly it more slowly (--slow-down finds how much), or change "
            "the limit"
        )
    return Follow(trajectory, radians(config.limits.max_yaw_rate_deg_s), factor)


def _envelope(config: Config) -> Envelope:
    """What the vehicle may be asked for, from where the programme begins."""
    limits, (min_thrust, max_thrust) = config.limits, thrust_limits(config)
    return Envelope(
        max_tilt=radians(limits.max_tilt_deg),
        max_tilt_rate=radians(limits.max_tilt_rate_deg_s),
        max_yaw_rate=radians(limits.max_yaw_rate_deg_s),
        min_thrust=min_thrust,
        max_thrust=max_thrust,
        max_climb=limits.max_climb_m_s,
        max_descent=limits.max_descent_m_s,
        fence_radius=limits.fence_radius_m,
        fence_ceiling=limits.fence_ceiling_m,
        fence_floor=limits.fence_floor_m - config.flight.takeoff_height_m,
        drag=config.guidance.drag_per_s,
        gravity=GRAVITY,
    )
