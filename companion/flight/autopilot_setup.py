"""What our configuration says, in the words in which an autopilot's parameters are judged."""

from math import radians

from companion.config import Config
from companion.mavlink.parameter_rules import Setup


def autopilot_setup(config: Config) -> Setup:
    """The configuration in SI, as far as the autopilot's parameters have to agree with it."""
    tilt_limit = config.vehicle.acceleration_limit_deg_s2
    yaw_limit = config.vehicle.yaw_acceleration_limit_deg_s2 or tilt_limit
    return Setup(
        source_system=config.link.source_system,
        attitude_rate_hz=config.link.attitude_rate_hz,
        silence_limit=1e-3 * config.deadman.silence_limit_ms,
        hover_thrust=config.thrust.hover_thrust,
        curve_factor=config.thrust.curve_factor,
        tilt_compensated=config.thrust.autopilot_compensates_tilt,
        tilt_acceleration_limit=None if tilt_limit is None else radians(tilt_limit),
        yaw_acceleration_limit=None if yaw_limit is None else radians(yaw_limit),
        max_tilt=radians(config.limits.max_tilt_deg),
    )
