"""The whole control loop on one horizontal axis as a linear model, built from the configuration.

The model contains planner, rate loop, tilt, motion and guidance near hover, while no limit is
reached. `tests/tuning/test_loop.py` compares the model with the program's own code.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from companion.attitude import PLANNER_NAMES
from companion.attitude.planner import MODEL_FOLLOWING
from companion.attitude.rate_response import AxisResponse, feedback_gain
from companion.attitude.reference_model import braking_lead, model_lag
from companion.config import Config
from companion.config.guidance import LINEAR
from companion.config.known_drag import drag_prior
from companion.control.hold_settings import observer_settings
from companion.control.inner_loop import tilt_damping, tilt_lag_and_dead_time
from companion.control.outer_loop import linear_settings
from companion.files.yaml_file import ConfigError
from companion.guidance import GRAVITY
from companion.tuning.feedback import Complex, guidance_feedback, hold_element

UNSTAMPED_POSITION_DELAY = 0.010
"""Delay of the autopilot's position that is not contained in its time stamp, s."""
_DEFAULT_LAG, _DEFAULT_DEAD_TIME = 0.07, 0.05
"""Lag and dead time of the rate loop of a heavy vehicle, s; used if they are not identified."""


@dataclass(frozen=True, slots=True)
class ModelMismatch:
    """Difference between the real rate loop and the configured one."""

    time_factor: float = 1.0
    """Factor on lag and dead time: real value / configured value."""
    delay: float = 0.0
    """Additional dead time, s."""
    gain: float = 1.0
    """Factor on the body rates: real rate / commanded rate."""


EXACT = ModelMismatch()


@dataclass(frozen=True, slots=True)
class Loop:
    """Frequency responses of the control loop and of its parts, each (n,).

    "Coefficient" is an acceleration coefficient: horizontal acceleration per specific thrust.
    """

    s: Complex
    """Complex frequencies, rad/s."""
    gain_at_rate: Complex
    """Loop gain with the loop opened at the commanded body rate; includes all feedback."""
    gain_at_acceleration: Complex
    """Loop gain with the loop opened at the commanded acceleration; the attitude loop stays
    closed."""
    rate_response: Complex
    """Response of the coefficient to the commanded body rate, s."""
    command_response: Complex
    """Response of the coefficient to the coefficient that guidance commands, without feedback."""
    velocity_feedback: Complex
    """Response of the commanded coefficient to the measured velocity, sign reversed, s/m."""
    position_feedback: Complex
    """Response of the commanded coefficient to the measured position, sign reversed, 1/m."""
    drag: float
    """Linear drag, 1/s."""

    def responses_to_acceleration(self) -> tuple[Complex, Complex]:
        """Responses of position (m) and rate command (rad/s) to a disturbing acceleration, m/s²."""
        velocity_response = 1.0 / (self.s + self.drag)
        tilt = self._closed_loop_tilt(
            (self.velocity_feedback + self.position_feedback / self.s) * velocity_response
        )
        return (GRAVITY * tilt + 1.0) * velocity_response / self.s, tilt / self.rate_response

    def responses_to_error(self, feedback: Complex) -> tuple[Complex, Complex]:
        """Responses of position (m) and commanded rate (rad/s) to an error of a measurement.

        `feedback`: `velocity_feedback` for an error in m/s, `position_feedback` for an error in m.
        """
        tilt = self._closed_loop_tilt(feedback)
        return GRAVITY * tilt / (self.s * (self.s + self.drag)), tilt / self.rate_response

    def _closed_loop_tilt(self, feedback: Complex) -> Complex:
        """Closed-loop response of the coefficient if `feedback` reduces guidance's command."""
        return -self.command_response * feedback / (1.0 + self.gain_at_rate)


def control_loop(config: Config, s: Complex, mismatch: ModelMismatch = EXACT) -> Loop:
    """The frequency responses of a configuration's control loop; see `control_loops`."""
    return control_loops(config, s)(mismatch)


def control_loops(config: Config, s: Complex) -> Callable[[ModelMismatch], Loop]:
    """A function that returns the control loop of a configuration for each model error.

    What does not depend on the error, most of the work, is computed once.

    Args:
        config: gains, weights and the assumed vehicle.
        s: (n,), frequencies, rad/s, none of them 0.

    Raises:
        ConfigError: the model does not support the configured planner or guidance.
    """
    if config.planner_name not in PLANNER_NAMES or config.guidance.kind != LINEAR:
        raise ConfigError(
            f"planner {config.planner_name} with guidance {config.guidance.kind} cannot be "
            "analysed; set planner.name: auto and guidance.kind: linear"
        )
    guidance, drag = linear_settings(config), drag_prior(config).drag.linear
    target_response, rate_feedback = _planner_response(config, s)
    axis = _slower_axis(config)
    hold = hold_element(s, 1.0 / config.link.attitude_rate_hz)
    guidance_hold = hold_element(s, guidance.period)
    feedback = guidance_feedback(
        s, guidance, observer_settings(config), drag, 1.0 / config.link.position_rate_hz
    )
    position_delay = np.exp(-s * UNSTAMPED_POSITION_DELAY)
    velocity, position = feedback.velocity * position_delay, feedback.position * position_delay
    total_tilt_feedback = feedback.tilt + GRAVITY / (s + drag) * (velocity + position / s)

    def loop_with(mismatch: ModelMismatch) -> Loop:
        rate_response = _rate_response(axis, s, mismatch)
        command_response = rate_response * target_response * guidance_hold
        attitude_path = rate_response * hold * rate_feedback
        guidance_path = command_response * total_tilt_feedback
        return Loop(
            s=s,
            gain_at_rate=attitude_path + guidance_path,
            gain_at_acceleration=guidance_path / (1.0 + attitude_path),
            rate_response=rate_response,
            command_response=command_response,
            velocity_feedback=velocity,
            position_feedback=position,
            drag=drag,
        )

    return loop_with


def _rate_response(axis: AxisResponse, s: Complex, mismatch: ModelMismatch) -> Complex:
    """Response (n,) of the coefficient to the commanded body rate; its unit is the second."""
    time_factor = mismatch.time_factor
    dead_time = np.exp(-s * (time_factor * axis.dead_time + mismatch.delay))
    lag = 1.0 + time_factor * s * (axis.lag + time_factor * s * axis.sigma)
    return mismatch.gain * dead_time / lag / s


def _slower_axis(config: Config) -> AxisResponse:
    """Configured response of the slower of roll and pitch; if unknown, that of a heavy vehicle."""
    if not config.vehicle.response_known:
        return AxisResponse(_DEFAULT_LAG, _DEFAULT_DEAD_TIME)
    lag, dead_time = tilt_lag_and_dead_time(config)
    return AxisResponse(lag, dead_time, damping=tilt_damping(config))


def _planner_response(config: Config, s: Complex) -> tuple[Complex, float]:
    """Responses of the body rate to the target coefficient and to the measured coefficient, 1/s.

    The first response is (n,); the second is a number, with reversed sign.

    `model-following` commands the rates that make a lagging rate loop follow its reference model,
    plus feedback of the difference between the coefficient and the model's coefficient one dead
    time ago. All other planners command p times the error of the coefficient.
    """
    gain = config.planner.gain_per_s
    if config.planner_name != MODEL_FOLLOWING:
        return np.full_like(s, gain), gain
    axis = _slower_axis(config)
    feedback, reference_lag = feedback_gain(gain, axis), model_lag(gain, axis.lag)
    braking_factor = 1.0 + gain * braking_lead(gain, reference_lag)
    model_response = gain / (s * (braking_factor + s * (reference_lag + s * axis.sigma)) + gain)
    inverse_lag = s * (1.0 + s * (axis.lag + s * axis.sigma))
    target_response = (inverse_lag + feedback * np.exp(-s * axis.dead_time)) * model_response
    return target_response, feedback
