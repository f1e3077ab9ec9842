"""Builds the outer loop from the configuration: guidance, motion estimate, predictive control."""

from collections.abc import Callable
from math import tan

from companion import plugins
from companion.attitude.reference_model import model_lag
from companion.config import Config
from companion.config.guidance import GUIDANCE_NAMES
from companion.config.known_drag import drag_prior
from companion.control.inner_loop import (
    heading_response,
    plugin,
    slower_tilt,
    thrust_limits,
    tilt_response,
)
from companion.control.motion_estimate import MotionEstimate
from companion.control.predictive import Predictive
from companion.files.yaml_file import ConfigError
from companion.guidance import (
    GRAVITY,
    IMMEDIATE,
    DragEstimate,
    HeightGains,
    LinearGuidance,
    LinearSettings,
    MotionObserver,
    ObserverSettings,
    Weights,
    chain_gains,
)
from companion.guidance.feedback import ChainGains
from companion.guidance.follow import Follow
from companion.guidance.linear import Guidance
from companion.guidance.position_correction import CorrectionSettings, PositionCorrection
from companion.nmpc import Settings, Solver

_CALM = Weights(position=1.0, velocity=1.5)
"""Low weights of the hold between doublets, so that its commands do not disturb `identify`."""
_CALM_BANDWIDTH = 1.0
"""Bandwidth of the disturbance estimate of that hold, rad/s."""
_LOCKSTEP_DEADLINE = 1.0
"""Deadline of the solver in lockstep, where the vehicle waits, s of wall time."""
_USUAL_RATE_LOOP = 0.12
"""Lag plus dead time of a heavy vehicle's rate loop, assumed if none is identified, s."""
_QUICK, _SLOW = 0.065, 0.08
"""Range over which the hold changes from stiff to normal: dead time, plus half the lag, plus half
the time in which the rate loop slews to the largest roll-pitch rate, s."""
_POSITION_TIME = 0.1
"""Time constant with which the estimated position follows the measured one, s."""
_POSITION_PULL = 4.0, 8.0
"""Gain from the position error to the observed velocity, with a slow and a quick rate loop, 1/s. It
is needed because the velocities of PX4 and ArduPilot are off by 0.05 m/s for seconds (measured)."""
_CORRECTS_WITHIN = 0.65
"""Time constant of the position corrections of PX4's and ArduPilot's estimators (measured), s."""
_CORRECTION_WINDOW = 0.1
"""Time constant of the two low-pass filters on the position correction, s."""
_LARGEST_CORRECTION = 0.2
"""Largest anticipated correction, m: the noise of a bad GPS must not move the vehicle."""


def hold_weights(config: Config) -> Weights:
    """The weights of the position hold; those not configured follow from the delay T.

    T is the delay of the attitude behind its target (`attitude_delay`).

    The weights 1/T⁴ and 1/T² place the poles of the hold at 1/T. A quick rate loop allows twice the
    position weight. `tests/control/test_margins.py` checks the stability margins against errors of
    T and of the thrust.
    """
    guidance, delay = config.guidance, attitude_delay(config)
    position, velocity = guidance.position_weight_per_s4, guidance.velocity_weight_per_s2
    return Weights(
        (1.0 + _rate_loop_quickness(config)) / delay**4 if position is None else position,
        1.0 / delay**2 if velocity is None else velocity,
    )


def _rate_loop_quickness(config: Config) -> float:
    """1 for rate loops up to `_QUICK`; 0 from `_SLOW` on and for an unidentified rate loop.

    A rate loop that slews slowly is late in large motions only: a stiff hold would swing on after
    them for good, as on the ArduPilot mock at 200 °/s.
    """
    if not config.vehicle.known:
        return 0.0
    lag, dead_time = slower_tilt(config)
    limits = config.vehicle.axes["roll"], config.vehicle.axes["pitch"]
    slews = [axis.acceleration_limit for axis in limits if axis.acceleration_limit is not None]
    slewing = config.limits.max_tilt_rate / min(slews) if slews else 0.0
    late = dead_time + 0.5 * lag + 0.5 * slewing
    return min(max(0.0, (_SLOW - late) / (_SLOW - _QUICK)), 1.0)


def _position_pull(config: Config) -> float:
    slow, quick = _POSITION_PULL
    return slow + _rate_loop_quickness(config) * (quick - slow)


def disturbance_bandwidth(config: Config) -> float:
    """Bandwidth of the wind estimate, rad/s: as configured, or 1.5 times that of the hold."""
    configured = config.guidance.disturbance_bandwidth_rad_s
    return 1.5 / attitude_delay(config) if configured is None else configured


def attitude_delay(config: Config) -> float:
    """The delay T of `hold_weights`, s; a usual rate loop is assumed if none is identified."""
    delay = _feedback_delay(config)
    return delay if config.vehicle.known else delay + _USUAL_RATE_LOOP


def _feedback_delay(config: Config) -> float:
    """Delay of the attitude plus half a guidance period, the mean delay of the feedback, s."""
    return tilt_response(config).effective_delay + 0.5 / config.guidance.rate_hz


def make_guidance(config: Config) -> Guidance:
    """Linear guidance, or the guidance of another package that `guidance.kind` names.

    Raises:
        ConfigError: the guidance of another package cannot be loaded.
    """
    settings, kind = linear_settings(config), config.guidance.kind
    if kind in GUIDANCE_NAMES:
        return LinearGuidance(settings)
    try:
        made: Guidance = plugin(plugins.GUIDANCE, kind)(settings)
    except TypeError as error:
        raise ConfigError(f"guidance.kind {kind} cannot be made: {error}") from error
    return made


def hold_gains(config: Config) -> ChainGains:
    """The gains of the position hold that follow from its weights."""
    weights = _CALM if _flies_identify(config) else hold_weights(config)
    return chain_gains(weights, _feedback_delay(config), drag_prior(config).drag.linear)


def linear_settings(config: Config) -> LinearSettings:
    """Settings of guidance; `limits.max_tilt` gives its largest horizontal acceleration."""
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
        max_horizontal=GRAVITY * tan(limits.max_tilt),
        thrust_lag=config.thrust.lag,
        period=period,
    )


def motion_estimate(
    config: Config, offset: Callable[[], float | None] = lambda: None
) -> MotionEstimate:
    """The motion observer with the drag for the feedforward.

    Args:
        config: configuration of the flight.
        offset: returns vehicle time minus event-loop time, s, or None.
    """
    correction = CorrectionSettings(
        _CORRECTS_WITHIN,
        _CORRECTION_WINDOW,
        _LARGEST_CORRECTION,
        config.guidance.position_lateness,
    )
    return MotionEstimate(
        MotionObserver(observer_settings(config)),
        PositionCorrection(correction),
        DragEstimate(drag_prior(config)),
        offset,
    )


def observer_settings(config: Config) -> ObserverSettings:
    """Settings of the motion observer."""
    bandwidth = _CALM_BANDWIDTH if _flies_identify(config) else disturbance_bandwidth(config)
    largest = config.guidance.max_disturbance_m_s2
    return ObserverSettings(bandwidth, _POSITION_TIME, _position_pull(config), largest)


def predictive(config: Config, part: Follow, note: Callable[[str], None]) -> Predictive:
    """Predictive control of one trajectory; starts its process.

    Raises:
        ConfigError: the planner's response is too fast for the steps of the horizon.
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
    """The settings of predictive control: response and limits of the vehicle.

    Raises:
        ConfigError: the planner's response is too fast for the steps of the horizon.
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
            f"guidance.kind: nmpc does not work with this vehicle: {error}; use guidance.kind: "
            "linear"
        ) from error


def _flies_identify(config: Config) -> bool:
    return "identify" in config.flight.maneuvers
