"""What our configuration says, in the words in which an autopilot's parameters are judged."""

from companion.config import Config
from companion.vehicle.parameter_rules import Setup


def autopilot_setup(config: Config) -> Setup:
    """The configuration in SI, as far as the autopilot's parameters have to agree with it."""
    limits = {name: axis.acceleration_limit for name, axis in config.vehicle.axes.items()}
    return Setup(
        source_system=config.link.source_system,
        attitude_rate_hz=config.link.attitude_rate_hz,
        silence_limit=config.deadman.silence_limit,
        hover_thrust=config.thrust.hover_thrust,
        curve_factor=config.thrust.curve_factor,
        battery_exponent=config.thrust.battery_exponent,
        tilt_compensated=config.thrust.autopilot_compensates_tilt,
        acceleration_limits=limits,
        max_tilt=config.limits.max_tilt,
        signs=config.link.signing_key_file is not None,
    )
