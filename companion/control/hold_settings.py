"""Gains of the position hold and of its observer, computed from the response of the rate loop."""

from math import inf, isfinite

from companion.attitude.rate_response import FIRST_ORDER_LAG_SHARE
from companion.config import Config
from companion.config.known_drag import drag_prior
from companion.control.inner_loop import (
    sensible_gain,
    tilt_damping,
    tilt_lag_and_dead_time,
    tilt_response,
)
from companion.guidance import ObserverSettings, Weights, horizontal_gains
from companion.guidance.feedback import HorizontalGains
from companion.guidance.position_correction import CorrectionSettings

_IDENTIFY_HOLD_WEIGHTS = Weights(position=1.0, velocity=1.5)
"""Low weights of the hold between doublets, so that its commands do not disturb `identify`."""
_USUAL_RATE_LOOP_DELAY = 0.12
"""Lag plus dead time of a heavy vehicle's rate loop, assumed if none is identified, s."""
_STIFF_HOLD_DELAYS = 0.065, 0.08
"""Two delays of the rate loop, s: below the first the hold is stiff, above the second it is normal.
The delay is dead time + half the lag + half the time to slew to the largest roll-pitch rate."""
_SHORTEST_HOLD_DELAY = 0.275
"""Smallest delay T from which weights of the hold are computed, s. A smaller T would give higher
weights, which amplify the noise of the estimate: the rate loop would always slew, and the vehicle
would swing."""
_SECOND_ORDER_LAG_SHARE = 0.2
"""If the lag is of second order, this share of it is added to the delay T of the hold. The hold
then has the same stability margins as with a first-order model of PX4's rate loop."""
_QUICK_OBSERVER_DELAYS = 0.035, 0.06
"""Delays of the rate loop (dead time plus half the lag) between which the observer changes from
quick to normal, s."""
_QUICK_OBSERVER_GAINS = 5.0, 7.0
"""Gains of the planner between which the observer changes from quick to normal, 1/s: the gain
amplifies the noise. The ArduPilot mock, limited to 90 °/s, never stopped oscillating with a gain of
7.5 and a quick observer."""
_BANDWIDTH_INCREASE = 0.6
"""`ObserverSettings.bandwidth_increase` of a quick observer."""
_IDENTIFY_BANDWIDTH = 1.0
"""Bandwidth of the disturbance estimate in a flight that identifies the vehicle, rad/s."""
_POSITION_TIME_CONSTANT = 0.1
"""Time constant with which the estimated position follows the measured one, s."""
_POSITION_COUPLINGS = 4.0, 8.0
"""`ObserverSettings.position_coupling` with a slow and with a quick rate loop, 1/s. With 0, the
observer would trust the velocities of PX4 and ArduPilot, which are wrong by 0.05 m/s for seconds
(measured)."""
_TRUSTED_COUPLING_INCREASE = 5.0
"""`ObserverSettings.coupling_increase` with a quick rate loop, 1/s. With recorded errors of PX4's
and ArduPilot's estimators the vehicle moves 5 to 25 % less than without the increase."""
_CORRECTION_TIME_CONSTANT = 0.65
"""Time constant of the position corrections of PX4's and ArduPilot's estimators (measured), s."""
_CORRECTION_OUTPUT_DELAY = 0.2
"""Delay after which the estimators' corrections show in the reported position, s. The true
positions of ArduPilot fit 0.3 s. With 0.3 s, figure-eights are flown best, but circles worse,
because the reported velocity is late, too."""
_CORRECTION_FILTER_TIMES = 0.1, 0.04
"""`CorrectionSettings.filter_time` with a normal and with a quick observer, s."""
_LARGEST_CORRECTION = 0.2
"""Largest position correction that is anticipated, m; GPS noise must not move the vehicle."""


def hold_weights(config: Config) -> Weights:
    """The weights of the position hold; weights not configured are computed from the delay T.

    T is the delay of the attitude behind its target (`attitude_delay`), but at least 0.275 s. The
    weights 1/T⁴ (position) and 1/T² (velocity) place the three poles of the hold about 1/T from the
    origin. A quick rate loop allows up to twice the position weight.
    `tests/control/test_margins.py` checks the stability margins against errors of T and thrust.
    """
    guidance, delay = config.guidance, _hold_delay(config)
    position, velocity = guidance.position_weight_per_s4, guidance.velocity_weight_per_s2
    return Weights(
        (1.0 + _hold_stiffness(config)) / delay**4 if position is None else position,
        1.0 / delay**2 if velocity is None else velocity,
    )


def _falling_ramp(value: float, bounds: tuple[float, float]) -> float:
    """Share that is 1 up to the lower bound and 0 from the upper one on; linear in between."""
    lower, upper = bounds
    return min(max(0.0, (upper - value) / (upper - lower)), 1.0)


def _hold_stiffness(config: Config) -> float:
    """How stiff a hold the rate loop allows, from 0 (normal) to 1 (stiff).

    A rate loop that slews slowly is late only in large motions. After a large motion a stiff hold
    would never stop oscillating, as on the ArduPilot mock with a rate limit of 200 °/s.
    """
    return _falling_ramp(_rate_loop_delay(config) + slewing_delay(config), _STIFF_HOLD_DELAYS)


def slewing_delay(config: Config) -> float:
    """Half the time in which the rate loop slews to the largest roll-pitch rate, s.

    The result is 0 s if no limit of the angular acceleration is known.
    """
    axes = config.vehicle.axes["roll"], config.vehicle.axes["pitch"]
    limits = [axis.acceleration_limit for axis in axes if axis.acceleration_limit is not None]
    return 0.5 * config.limits.max_tilt_rate / min(limits) if limits else 0.0


def _rate_loop_delay(config: Config) -> float:
    """Delay of the rate loop: dead time plus half the lag, s; infinite if it is not identified.

    A second-order lag is first converted to a first-order lag plus dead time
    (`FIRST_ORDER_LAG_SHARE`), because it delays quick commands more than a first-order lag of the
    same length.
    """
    lag, dead_time = tilt_lag_and_dead_time(config)
    first_order_share = FIRST_ORDER_LAG_SHARE if isfinite(tilt_damping(config)) else 1.0
    return (
        dead_time + (1.0 - 0.5 * first_order_share) * lag if config.vehicle.response_known else inf
    )


def observer_quickness(config: Config) -> float:
    """How quick a motion observer the rate loop and the planner's gain allow: 0 normal, 1 quick.

    Always 0 if the bandwidth of the wind estimate is configured, or in a flight that identifies the
    vehicle.

    A quick observer follows the corrected position, so errors of the autopilot's velocity matter
    less. The commands are less calm then: on a rate loop like PX4's, body rates in hover double.
    """
    if config.guidance.disturbance_bandwidth_rad_s is not None or flies_identify(config):
        return 0.0
    quickness_by_rate_loop = _falling_ramp(_rate_loop_delay(config), _QUICK_OBSERVER_DELAYS)
    return quickness_by_rate_loop * _falling_ramp(config.planner.gain_per_s, _QUICK_OBSERVER_GAINS)


def observer_settings(config: Config) -> ObserverSettings:
    """The settings of the motion observer."""
    slow_coupling, quick_coupling = _POSITION_COUPLINGS
    loop_quickness = _falling_ramp(_rate_loop_delay(config), _STIFF_HOLD_DELAYS)
    return ObserverSettings(
        _IDENTIFY_BANDWIDTH if flies_identify(config) else disturbance_bandwidth(config),
        _POSITION_TIME_CONSTANT,
        slow_coupling + loop_quickness * (quick_coupling - slow_coupling),
        config.guidance.max_disturbance_m_s2,
        _BANDWIDTH_INCREASE * observer_quickness(config),
        loop_quickness * _TRUSTED_COUPLING_INCREASE,
    )


def correction_settings(config: Config) -> CorrectionSettings:
    """The settings of the position correction."""
    slow_time, quick_time = _CORRECTION_FILTER_TIMES
    return CorrectionSettings(
        _CORRECTION_TIME_CONSTANT,
        slow_time + observer_quickness(config) * (quick_time - slow_time),
        _LARGEST_CORRECTION,
        config.guidance.position_lateness,
        _CORRECTION_OUTPUT_DELAY,
    )


def disturbance_bandwidth(config: Config) -> float:
    """Bandwidth of the wind estimate, rad/s: as configured, or 1.5/T (see `hold_weights`)."""
    configured_bandwidth = config.guidance.disturbance_bandwidth_rad_s
    return 1.5 / _hold_delay(config) if configured_bandwidth is None else configured_bandwidth


def attitude_delay(config: Config) -> float:
    """Delay of the attitude behind its target, s; assumes a usual rate loop if none is identified.

    The gain counts as at most the largest sensible gain: more gain hardly makes the attitude
    quicker, and a stiffer hold would oscillate.
    """
    excess_delay = 1.0 / sensible_gain(config) - 1.0 / config.planner.gain_per_s
    delay = feedback_delay(config) + max(0.0, excess_delay)
    if isfinite(tilt_damping(config)):
        delay += _SECOND_ORDER_LAG_SHARE * tilt_lag_and_dead_time(config)[0]
    return delay if config.vehicle.response_known else delay + _USUAL_RATE_LOOP_DELAY


def _hold_delay(config: Config) -> float:
    """The delay T that sets weights and wind estimate, s: `attitude_delay`, at least 0.275 s."""
    return max(_SHORTEST_HOLD_DELAY, attitude_delay(config))


def feedback_delay(config: Config) -> float:
    """`InnerResponse.effective_delay` plus the mean wait for a guidance step (half a period), s."""
    return tilt_response(config).effective_delay + 0.5 / config.guidance.rate_hz


def hold_gains(config: Config) -> HorizontalGains:
    """The gains of the position hold that follow from its weights.

    Raises:
        ValueError: no positive and finite gains follow.
    """
    weights = _IDENTIFY_HOLD_WEIGHTS if flies_identify(config) else hold_weights(config)
    return horizontal_gains(weights, feedback_delay(config), drag_prior(config).drag.linear)


def flies_identify(config: Config) -> bool:
    """Whether the flight identifies the vehicle; the hold then has low gains."""
    return "identify" in config.flight.maneuvers
