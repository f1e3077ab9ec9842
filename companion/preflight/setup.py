"""What our configuration says, in the words in which an autopilot's parameters are judged."""

from math import radians

from companion.config import Config
from companion.vehicle.parameter_rules import Setup


def autopilot_setup(config: Config) -> Setup:
    """The configuration in SI, as far as the autopilot's parameters have to agree with it."""
    limits = {name: axis.acceleration_limit_deg_s2 for name, axis in config.vehicle.axes.items()}
    return Setup(
        source_system=config.link.source_system,
        attitude_rate_hz=config.link.attitude_rate_hz,
        silence_limit=1e-3 * config.deadman.silence_limit_ms,
        hover_thrust=config.thrust.hover_thrust,
        curve_factor=config.thrust.curve_factor,
        battery_exponent=config.thrust.battery_exponent,
        tilt_compensated=config.thrust.autopilot_compensates_tilt,
        acceleration_limits={
            name: None if limit is None else radians(limit) for name, limit in limits.items()
        },
        max_tilt=radians(config.limits.max_tilt_deg),
        signs=config.link.signing_key_file is not None,
    )
