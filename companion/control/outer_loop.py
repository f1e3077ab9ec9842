"""Builds the outer loop from the configuration: guidance, motion estimate, predictive control."""

from collections.abc import Callable
from math import isfinite

from companion import plugins
from companion.attitude.reference_model import model_lag
from companion.config import Config
from companion.config.guidance import GUIDANCE_NAMES
from companion.config.known_drag import drag_prior
from companion.control.hold_settings import correction_settings, hold_gains, observer_settings
from companion.control.inner_loop import (
    heading_response,
    plugin,
    thrust_limits,
    tilt_lag_and_dead_time,
    tilt_response,
)
from companion.control.motion_estimate import MotionEstimate
from companion.control.predictive import PredictiveControl
from companion.drag import NO_DRAG
from companion.files.yaml_file import ConfigError
from companion.guidance import (
    IMMEDIATE,
    DragEstimate,
    GuidanceInput,
    HeightGains,
    LinearGuidance,
    LinearSettings,
    MotionObserver,
    Reference,
    VehicleMotion,
)
from companion.guidance.follow import Follow
from companion.guidance.linear import Guidance
from companion.guidance.plugin_guidance import PluginGuidance
from companion.guidance.position_correction import PositionCorrection
from companion.nmpc import Settings, Solver

_DEADLINE_IF_VEHICLE_WAITS = 1.0
"""Deadline of the solver if the vehicle waits for it, s of wall time."""


def make_guidance(config: Config) -> Guidance:
    """Linear guidance, or the guidance of another package that `guidance.kind` names.

    Raises:
        ConfigError: the guidance of another package cannot be loaded or made, or fails a trial.
    """
    kind, settings = config.guidance.kind, linear_settings(config)
    if kind in GUIDANCE_NAMES:
        return LinearGuidance(settings)
    factory = plugin("guidance.kind", plugins.GUIDANCE, kind)
    try:
        # Guidance may remember the trial, so another instance flies.
        trial_guidance, flight_guidance = factory(settings), factory(settings)
    except Exception as error:
        raise ConfigError(f"guidance.kind: {kind} cannot be made: {error!r}") from error
    _require_command(kind, trial_guidance, thrust_limits(config))
    return PluginGuidance(flight_guidance)


def _require_command(kind: str, guidance: Guidance, thrust_limits: tuple[float, float]) -> None:
    """Check guidance of another package: ask it once to hold a vehicle that is at rest.

    `kind`: its name in `guidance.kind`. `thrust_limits`: of the specific thrust, m/s².

    Raises:
        ConfigError: the guidance raises, or does not return a `LinearCommand` of finite numbers.
    """
    motion_at_rest = VehicleMotion((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    inputs = GuidanceInput(
        motion_at_rest, motion_at_rest, (0.0, 0.0), (0.0, 0.0), NO_DRAG, thrust_limits
    )
    try:
        command = guidance.command(lambda _: Reference(motion_at_rest.position_ned), 0.0, inputs)
        target, later_target, acceleration_down = command
        numbers = (guidance.effect_delay, *target, *later_target, acceleration_down)
        is_finite = all(map(isfinite, numbers))
    except (Exception, SystemExit) as error:
        raise ConfigError(
            f"guidance.kind: {kind} cannot be flown: {error!r}; guidance must have the methods of "
            "companion.guidance.linear.Guidance"
        ) from error
    if not is_finite:
        raise ConfigError(
            f"guidance.kind: {kind} cannot be flown: for a vehicle at rest its command and "
            f"`effect_delay` must be finite, but they are {command} and {guidance.effect_delay} s"
        )


def linear_settings(config: Config) -> LinearSettings:
    """Settings of linear guidance; its horizontal acceleration is limited by `limits.max_tilt_deg`.

    Raises:
        ValueError: the gains of the position hold cannot be computed.
    """
    guidance, limits = config.guidance, config.limits
    tilt, heading, period = tilt_response(config), heading_response(config), 1.0 / guidance.rate_hz
    if not guidance.lead:
        tilt = heading = IMMEDIATE
    return LinearSettings(
        gains=hold_gains(config),
        height=HeightGains(
            height=guidance.height_gain_per_s,
            climb=guidance.climb_gain_per_s,
            max_climb=limits.max_climb_m_s,
            max_descent=limits.max_descent_m_s,
        ),
        tilt=tilt,
        heading=heading,
        max_horizontal_acceleration=limits.max_horizontal_acceleration,
        thrust_lag=config.thrust.lag,
        period=period,
    )


def motion_estimate(config: Config, clock_offset: Callable[[], float | None]) -> MotionEstimate:
    """The motion estimate with its observer, position correction and drag estimate.

    `clock_offset`: returns vehicle time minus event-loop time, s; None: not known yet.
    """
    return MotionEstimate(
        MotionObserver(observer_settings(config)),
        PositionCorrection(correction_settings(config)),
        DragEstimate(drag_prior(config)),
        clock_offset,
    )


def make_predictive_control(
    config: Config, maneuver: Follow, note: Callable[[str], None], *, vehicle_waits: bool
) -> PredictiveControl:
    """Predictive control of one trajectory; starts its process.

    Args:
        config: configuration of the flight.
        maneuver: the maneuver that flies the trajectory.
        note: called with messages for the user.
        vehicle_waits: whether the vehicle waits for the solver: in lockstep or on a virtual clock.

    Raises:
        ConfigError: see `predictive_settings`.
        MissingExtraError: the solver is not installed.
    """
    settings = predictive_settings(config, vehicle_waits=vehicle_waits)
    return PredictiveControl(
        lambda report: Solver(settings, maneuver.trajectory, report),
        period=settings.lead,
        vehicle_waits=vehicle_waits,
        note=note,
    )


def predictive_settings(config: Config, *, vehicle_waits: bool = False) -> Settings:
    """The settings of predictive control: response and limits of the vehicle.

    `vehicle_waits`: whether the vehicle waits for the solver, whose deadline is then longer than
    the period of guidance.

    Raises:
        ConfigError: the planner's response is too fast for the steps of the horizon, or gravity
            does not lie between the smallest and the largest thrust.
    """
    limits, (min_thrust, max_thrust) = config.limits, thrust_limits(config)
    response = tilt_response(config)
    period = 1.0 / config.guidance.rate_hz
    try:
        return Settings(
            gain=response.gain,
            yaw_gain=config.planner.yaw_gain_per_s,
            lag=response.lag or model_lag(config.planner.gain_per_s, 0.0),
            dead_time=tilt_lag_and_dead_time(config)[1],
            max_tilt=limits.max_tilt,
            max_tilt_rate=limits.max_tilt_rate,
            max_yaw_rate=limits.max_yaw_rate,
            min_thrust=min_thrust,
            max_thrust=max_thrust,
            lead=period,
            deadline=_DEADLINE_IF_VEHICLE_WAITS if vehicle_waits else period,
        )
    except ValueError as error:
        raise ConfigError(
            f"guidance.kind: nmpc does not work with this vehicle: {error}; use guidance.kind: "
            "linear"
        ) from error
