"""The outer loop put together from the configuration."""

from collections.abc import Callable
from math import tan

from companion.attitude.planner import MODEL_FOLLOWING
from companion.attitude.reference_model import model_lag, model_response
from companion.config import Config
from companion.config.known_drag import drag_prior
from companion.control.motion_estimate import MotionEstimate
from companion.control.predictive import Predictive
from companion.files.yaml_file import ConfigError
from companion.guidance import (
    GRAVITY,
    IMMEDIATE,
    DragEstimate,
    HeightGains,
    InnerResponse,
    LinearGuidance,
    LinearSettings,
    MotionObserver,
    ObserverSettings,
    Weights,
    chain_gains,
)
from companion.guidance.follow import Follow
from companion.guidance.position_correction import CorrectionSettings, PositionCorrection
from companion.nmpc import Settings, Solver

_CALM = Weights(position=1.0, velocity=1.5)
_LOCKSTEP_DEADLINE = 1.0
"""The vehicle waits for the answer, s of wall time."""
_CALM_BANDWIDTH = 1.0
"""Of the hold between doublets, rad/s: what they tell must not drown in the hold's own commands."""
_USUAL_RATE_LOOP = 0.12
"""Lag and dead time of a rate loop that nobody identified, s: a heavy vehicle's."""
_QUICK, _SLOW = 0.065, 0.08
"""Up to the first dead time with half the lag, s, the hold is stiffer; from the second on not."""
_POSITION_TIME = 0.1
"""With which the position follows the measured one, s."""
_POSITION_PULL = 4.0, 8.0
"""How much a position tells of the velocity, 1/s, behind a slow and behind a quick rate loop: the
velocities of real estimators are off by 0.05 m/s for seconds, measured on PX4 and ArduPilot against
truth."""
_CORRECTS_WITHIN = 0.65
"""Measured on PX4's and ArduPilot's estimators, which correct their positions this slowly, s."""
_CORRECTION_WINDOW = 0.1
"""Over which their corrections are averaged, twice, s."""
_LARGEST_CORRECTION = 0.2
"""Of what they still have to correct, m: the noise of a bad GPS must not move the vehicle."""


def tilt_response(config: Config) -> InnerResponse:
    """How the coefficients answer their targets: the planner behind the vehicle's rate loop."""
    gain, (lag, dead_time) = config.planner.gain_per_s, slower_tilt(config)
    follows = config.planner_name == MODEL_FOLLOWING
    if follows:
        gain, lag = model_response(gain, model_lag(gain, lag))
    return InnerResponse(gain, lag, dead_time, follows)


def slower_tilt(config: Config) -> tuple[float, float]:
    """Lag and dead time of roll or pitch, whichever is longer, s; 0 where it is not known.

    The quicker axis waits for the slower one, so that the coefficients answer like this.
    """
    axes = config.vehicle.axes
    tilt = axes["roll"], axes["pitch"]
    return (
        max(axis.lag or 0.0 for axis in tilt),
        max(axis.dead_time or 0.0 for axis in tilt),
    )


def heading_response(config: Config) -> InnerResponse:
    """How the heading answers its target."""
    yaw = config.vehicle.axes["yaw"]
    return InnerResponse(
        config.planner.yaw_gain_per_s,
        yaw.lag or 0.0,
        yaw.dead_time or 0.0,
        config.planner_name == MODEL_FOLLOWING,
    )


def hold_weights(config: Config) -> Weights:
    """The weights of the hold; those that are not told follow from the attitude's delay T.

    With 1/T⁴ and 1/T² the hold is as quick as the attitude: poles at 1/T but for the attitude's
    own. A quick rate loop allows twice the first of them. `tests/control/test_margins.py` shows
    what may be wrong with T and with the thrust then.
    """
    guidance, delay = config.guidance, hold_delay(config)
    position, velocity = guidance.position_weight_per_s4, guidance.velocity_weight_per_s2
    return Weights(
        (1.0 + _quickness(config)) / delay**4 if position is None else position,
        1.0 / delay**2 if velocity is None else velocity,
    )


def _quickness(config: Config) -> float:
    """Of the rate loop: 1 up to `_QUICK`, 0 from `_SLOW` on and where nobody identified it."""
    if not config.vehicle.known:
        return 0.0
    lag, dead_time = slower_tilt(config)
    return min(max(0.0, (_SLOW - dead_time - 0.5 * lag) / (_SLOW - _QUICK)), 1.0)


def _position_pull(config: Config) -> float:
    slow, quick = _POSITION_PULL
    return slow + _quickness(config) * (quick - slow)


def disturbance_bandwidth(config: Config) -> float:
    """How quickly wind is found, rad/s: as is told, or half as quick again as the hold."""
    told = config.guidance.disturbance_bandwidth_rad_s
    return 1.5 / hold_delay(config) if told is None else told


def hold_delay(config: Config) -> float:
    """T, s: with a usual rate loop where the vehicle's is not known."""
    delay = _feedback_delay(config)
    return delay if config.vehicle.known else delay + _USUAL_RATE_LOOP


def _feedback_delay(config: Config) -> float:
    """Of the attitude, s, and half a period of guidance, for which the feedback is held."""
    return tilt_response(config).effective_delay + 0.5 / config.guidance.rate_hz


def linear_guidance(config: Config) -> LinearGuidance:
    """Linear guidance; in a hover it asks for no more than the tilt limit gives."""
    guidance, limits = config.guidance, config.limits
    tilt, heading, period = tilt_response(config), heading_response(config), 1.0 / guidance.rate_hz
    drag = drag_prior(config).drag.linear
    weights = _CALM if _identifies(config) else hold_weights(config)
    if not guidance.lead:
        tilt = heading = IMMEDIATE
    return LinearGuidance(
        LinearSettings(
            gains=chain_gains(weights, _feedback_delay(config), drag),
            height=HeightGains(
                height=guidance.height_gain_per_s,
                climb=guidance.climb_gain_per_s,
                max_climb=limits.max_climb_m_s,
                max_descent=limits.max_descent_m_s,
            ),
            tilt=tilt,
            heading=heading,
            max_horizontal=GRAVITY * tan(limits.max_tilt),
            thrust_lag=config.thrust.lag,
            period=period,
        )
    )


def motion_estimate(
    config: Config, offset: Callable[[], float | None] = lambda: None
) -> MotionEstimate:
    """The observer of the motion, with the drag that is fed forward.

    Args:
        config: as it is flown.
        offset: the vehicle's clock minus ours, s, if it is known.
    """
    guidance = config.guidance
    bandwidth = _CALM_BANDWIDTH if _identifies(config) else disturbance_bandwidth(config)
    settings = ObserverSettings(
        bandwidth, _POSITION_TIME, _position_pull(config), guidance.max_disturbance_m_s2
    )
    correction = CorrectionSettings(
        _CORRECTS_WITHIN,
        _CORRECTION_WINDOW,
        _LARGEST_CORRECTION,
        guidance.position_lateness,
    )
    return MotionEstimate(
        MotionObserver(settings),
        PositionCorrection(correction),
        DragEstimate(drag_prior(config)),
        offset,
    )


def thrust_limits(config: Config) -> tuple[float, float]:
    """Smallest and largest specific thrust, as far as the configuration tells, m/s²."""
    per_thrust = GRAVITY / config.thrust.hover_thrust
    return config.limits.min_thrust * per_thrust, config.limits.max_thrust * per_thrust


def predictive(config: Config, part: Follow, note: Callable[[str], None]) -> Predictive:
    """Predictive control of one trajectory; starts its process.

    Raises:
        ConfigError: the planner's response is too quick for the horizon's steps.
        MissingExtraError: the solver is not installed.
    """
    settings = predictive_settings(config)
    return Predictive(
        lambda report: Solver(settings, part.trajectory, report),
        period=settings.lead,
        lockstep=config.link.lockstep,
        note=note,
    )


def predictive_settings(config: Config) -> Settings:
    """What predictive control is told of the vehicle.

    Raises:
        ConfigError: the planner's response is too quick for the horizon's steps.
    """
    limits, (min_thrust, max_thrust) = config.limits, thrust_limits(config)
    response = tilt_response(config)
    period = 1.0 / config.guidance.rate_hz
    try:
        return Settings(
            gain=response.gain,
            yaw_gain=config.planner.yaw_gain_per_s,
            lag=response.lag or model_lag(config.planner.gain_per_s, 0.0),
            dead_time=slower_tilt(config)[1],
            max_tilt=limits.max_tilt,
            max_tilt_rate=limits.max_tilt_rate,
            max_yaw_rate=limits.max_yaw_rate,
            min_thrust=min_thrust,
            max_thrust=max_thrust,
            lead=period,
            deadline=_LOCKSTEP_DEADLINE if config.link.lockstep else period,
        )
    except ValueError as error:
        raise ConfigError(
            f"guidance.kind: nmpc cannot be had with this vehicle: {error}"
        ) from error


def _identifies(config: Config) -> bool:
    return "identify" in config.flight.maneuvers
