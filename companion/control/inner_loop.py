"""Builds planner, limits, thrust conversion and vehicle response from the configuration."""

from math import inf
from typing import Any

from companion import plugins
from companion.attitude import PLANNER_NAMES, Constants, Limits, Planner, Target, make_planner
from companion.attitude.limits import make_constants
from companion.attitude.planner import MODEL_FOLLOWING
from companion.attitude.plugin_planner import PluginPlanner
from companion.attitude.reference_model import model_lag, model_response
from companion.attitude.types import AttitudeError
from companion.config import Config
from companion.config.known_drag import drag_prior
from companion.files.yaml_file import ConfigError
from companion.guidance import GRAVITY, HoverThrust, InnerResponse, ThrustSettings
from companion.user_code import UserCodeError

_TRIAL_INPUT = (1.0, 0.0, 0.0, 0.0), Target(0.1, 0.1, 0.0), 0.004
"""Attitude, target and sample period of the trial that a planner of another package must pass: a
step from level to 8° of tilt."""

LARGEST_GAIN_TIMES_DELAY = 0.45
"""Largest sensible product of gain and (lag + dead time); above it, the response overshoots."""


def planner(config: Config) -> Planner:
    """The configured planner with its limits; `model-following` gets the vehicle's response too.

    Raises:
        ConfigError: the planner of another package cannot be loaded or made, or fails a trial.
    """
    name, limits = config.planner_name, rate_limits(config)

    def make(law: Any) -> Planner:
        return make_planner(
            law,
            gain=config.planner.gain_per_s,
            yaw_gain=config.planner.yaw_gain_per_s,
            limits=limits,
            recovery_angle=config.limits.recovery_angle,
            **(config.vehicle.response if name == MODEL_FOLLOWING else {}),
        )

    if name in PLANNER_NAMES:
        return make(name)
    law = plugin("planner.name", plugins.PLANNERS, name)
    try:
        # A planner may remember the trial, so another instance flies.
        trial_planner, flight_planner = (PluginPlanner(make(law), limits) for _ in range(2))
    except Exception as error:
        raise ConfigError(f"planner.name: {name} cannot be made: {error!r}") from error
    try:
        trial_planner.rates(*_TRIAL_INPUT)
    except (AttitudeError, UserCodeError) as error:
        raise ConfigError(
            f"planner.name: {name} cannot be flown: {error}; "
            "`companion.testing.check_planner` tries more attitudes"
        ) from error
    return flight_planner


def planner_constants(config: Config) -> Constants:
    """Gains and limits of our own planners."""
    gains, recovery_angle = config.planner, config.limits.recovery_angle
    return make_constants(
        gains.gain_per_s, gains.yaw_gain_per_s, rate_limits(config), recovery_angle
    )


def plugin(key: str, group: str, name: str) -> Any:
    """Load a class or function of another package.

    Args:
        key: configuration key that names the plug-in, for messages.
        group: group of entry points of the plug-in.
        name: name of the plug-in in this group.

    Raises:
        ConfigError: the plug-in is not installed or cannot be loaded.
    """
    try:
        return plugins.load(group, name)
    except plugins.PluginError as error:
        raise ConfigError(f"{key}: {error}") from error


def rate_limits(config: Config) -> Limits:
    """The limits that every commanded attitude and body rate obeys."""
    limits = config.limits
    return Limits(
        max_tilt=limits.max_tilt,
        max_tilt_rate=limits.max_tilt_rate,
        max_yaw_rate=limits.max_yaw_rate,
        shape=limits.rate_limit,
    )


def hover_thrust(config: Config) -> HoverThrust:
    """The conversion of specific thrust to normalised thrust, 0..1."""
    thrust = config.thrust
    return HoverThrust(
        ThrustSettings(
            hover=thrust.hover_thrust,
            correction_limit=thrust.correction_limit,
            correction_time=thrust.correction_time_s,
            min_thrust=config.limits.min_thrust,
            max_thrust=config.limits.max_thrust,
            curve_factor=thrust.curve_factor,
            battery_exponent=thrust.battery_exponent,
            lag=thrust.lag,
            tilt_compensated=thrust.autopilot_compensates_tilt,
            drag=drag_prior(config).drag.linear,
        )
    )


def full_thrust(config: Config) -> float:
    """Specific thrust at a normalised thrust of 1, from the configured hover thrust, m/s²."""
    return GRAVITY / config.thrust.hover_thrust


def thrust_limits(config: Config) -> tuple[float, float]:
    """Smallest and largest specific thrust, from the configured hover thrust, m/s²."""
    full = full_thrust(config)
    return config.limits.min_thrust * full, config.limits.max_thrust * full


def with_gain(config: Config, gain: float) -> Config:
    """The configuration with another gain of the planner, 1/s."""
    planner = config.planner.model_copy(update={"gain_per_s": gain})
    return config.model_copy(update={"planner": planner})


def tilt_response(config: Config) -> InnerResponse:
    """Response of the acceleration coefficients to their targets: planner and rate loop."""
    gain, (lag, dead_time) = config.planner.gain_per_s, tilt_lag_and_dead_time(config)
    follows_model = config.planner_name == MODEL_FOLLOWING
    if follows_model:
        gain, lag = model_response(gain, model_lag(gain, lag))
    return InnerResponse(gain, lag, dead_time, follows_model)


def tilt_lag_and_dead_time(config: Config) -> tuple[float, float]:
    """The larger lag and the larger dead time of roll and pitch, s; 0 if unknown.

    The planner `model-following` delays the axis with the shorter dead time, so both axes respond
    with the larger values. With other planners these values are the worse case of both axes.
    """
    axes = config.vehicle.axes
    tilt = axes["roll"], axes["pitch"]
    return (max(axis.lag or 0.0 for axis in tilt), max(axis.dead_time or 0.0 for axis in tilt))


def tilt_damping(config: Config) -> float:
    """The lower damping ratio of roll and pitch; infinite where both are of first order."""
    axes = config.vehicle.axes
    return min(axes[name].damping or inf for name in ("roll", "pitch"))


def sensible_gain(config: Config) -> float:
    """Largest sensible gain of the planner, 1/s; infinite if the rate loop is not identified."""
    delay = sum(tilt_lag_and_dead_time(config))
    is_identified = config.vehicle.response_known and delay > 0.0
    return LARGEST_GAIN_TIMES_DELAY / delay if is_identified else inf


def heading_response(config: Config) -> InnerResponse:
    """Response of the heading to its target."""
    yaw = config.vehicle.axes["yaw"]
    return InnerResponse(
        config.planner.yaw_gain_per_s,
        yaw.lag or 0.0,
        yaw.dead_time or 0.0,
        config.planner_name == MODEL_FOLLOWING,
    )
