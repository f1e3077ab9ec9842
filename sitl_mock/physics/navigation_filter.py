"""The error of an autopilot's navigation filter, which is smooth and lasts for seconds.

The filter integrates the inertial sensor at a delayed fusion time, and satellite fixes correct its
state at this time. We compute only the error of the state. The error is linear and has a closed
form between two fixes, so we update the error at fixes only. Horizontal vectors are complex
numbers, north + j east.
"""

from math import exp, radians, sqrt
from random import Random

from sitl_mock.config.sensors import EkfConfig
from sitl_mock.physics.height_error import HeightErrorModel
from sitl_mock.physics.navigation_error import (
    ErrorConstants,
    Errors,
    ErrorState,
    FilterState,
    TruthRow,
    pending_correction_fraction,
    propagated_horizontal_errors,
    propagated_vertical_errors,
)
from sitl_mock.physics.rigid_body import GRAVITY
from sitl_mock.physics.slow_noise import next_slow_noise

_MIN_COURSE_SPEED = 0.5
"""Smallest speed for which the turn rate of the course is computed, m/s; the course of a slower
vehicle would seem to turn infinitely fast."""
_COMPASS_TIME_S = 20.0
"""Time constant with which the heading follows the compass without acceleration, s."""
_MAX_UNCERTAINTY = 0.1
"""Uncertainty of the heading after a long time without acceleration, s^3/m^2. Fixes correct the
heading at the rate uncertainty * acceleration^2, 1/s, and reduce the uncertainty, as in a Kalman
filter."""
_UNCERTAINTY_GROWTH = 0.0002
"""Growth of the uncertainty of the heading per second, s^2/m^2."""


class NavigationFilter:
    """Computes the errors of the navigation filter from fix to fix.

    Args:
        start: the true motion at time 0.

    Attributes:
        constants: constants of the errors between two fixes.
        state: errors after the latest fix.
    """

    def __init__(self, config: EkfConfig, start: TruthRow, seed: int) -> None:
        self._config = config
        self._period = config.fix_period_ms * 1e-3
        self._gains = (config.position_gains, config.velocity_gains, config.acceleration_gains)
        self._noise_decay = exp(-self._period / config.noise_time_s)
        self._yaw_decay = exp(-self._period / config.yaw_time_s)
        self.constants = ErrorConstants(
            config.acceleration_lead_ms * 1e-3,
            config.acceleration_scale,
            complex(*map(radians, config.tilt_bias_deg)),
            config.height_offset_m,
            config.predictor_ms,
            config.heading_predictor_ms,
        )
        self._uncertainty = _MAX_UNCERTAINTY
        self._random = Random(f"{seed}/navigation")
        self._height_model = HeightErrorModel(config, seed)
        self._slip_phase = Random(f"{seed}/slip").random()
        yaw = self._random.gauss(0.0, radians(config.yaw_error_deg))
        horizontal = self._initial_errors(1.0)
        vertical = self._initial_errors(config.vertical_share)
        position, velocity = complex(start[10], start[11]), complex(start[0], start[1])
        height = self._height_model.initial()
        self.state = FilterState(
            horizontal, vertical, yaw, 0.0, 0.0, height, 0.0, 0.0, position, velocity
        )

    def _initial_errors(self, ratio: float) -> ErrorState:
        """Return the errors after the first fix: the noise of a fix.

        `ratio`: 1 for horizontal errors, ``vertical_share`` for vertical errors.
        """
        noise = self._draw_noise(ratio)
        return ErrorState((*noise, 0j), (0j, 0j), noise)

    def is_due(self, fusion_time: float) -> bool:
        """Whether a fix is due at a fusion time, s."""
        return fusion_time - self.state.fused_at >= self._period - 1e-9

    def advance(self, fused: TruthRow, fused_at: float, present: TruthRow, now: float) -> None:
        """Correct the errors by a fix; the output follows gradually, without a jump.

        Args:
            fused: the true motion at the fusion time.
            fused_at: the fusion time, s.
            present: the true motion now.
            now: the present time, s.
        """
        config, constants, state = self._config, self.constants, self.state
        elapsed = fused_at - state.fused_at
        velocity = complex(fused[0], fused[1])
        acceleration = complex(fused[13], fused[14])
        errors = propagated_horizontal_errors(constants, state, fused, elapsed)
        noise = self._next_noise(state.horizontal.noise, 1.0)
        slip_phase = (fused_at / config.fix_slip_time_s + self._slip_phase) % 1.0
        slip_ms = config.fix_slip_ms * (0.5 - slip_phase)
        position_delay = (config.position_late_ms + slip_ms) * 1e-3 + constants.lead_time
        velocity_delay = (config.velocity_late_ms + slip_ms) * 1e-3 + constants.lead_time
        fix_errors = noise[0] - position_delay * velocity, noise[1] - velocity_delay * acceleration
        tilt_noise = GRAVITY * radians(config.tilt_noise_deg) * sqrt(elapsed)
        horizontal = self._corrected_state(errors, fix_errors, noise, tilt_noise)
        ratio = config.vertical_share
        noise = self._next_noise(state.vertical.noise, ratio)
        errors = propagated_vertical_errors(constants, state, fused, elapsed)
        vertical = self._corrected_state(errors, noise, noise, ratio * tilt_noise)
        noiseless_yaw = self._noiseless_yaw(velocity, acceleration, elapsed)
        yaw = self._next_yaw_noise() + noiseless_yaw
        yaw_fraction = pending_correction_fraction(constants.heading_predictor_ms, state, now)
        pending_yaw = yaw_fraction * state.pending_yaw + yaw - state.yaw
        since_correction = now - state.corrected_at
        height = self._height_model.next(state.height, abs(acceleration), since_correction)
        corrected = FilterState(
            horizontal,
            vertical,
            yaw,
            pending_yaw,
            noiseless_yaw,
            height,
            fused_at,
            now,
            complex(fused[10], fused[11]),
            velocity,
        )
        self.state = self._without_jump(corrected, present)

    def _without_jump(self, corrected: FilterState, truth: TruthRow) -> FilterState:
        """Return the corrected state with pending corrections that keep the output as it was."""
        constants, state, now = self.constants, self.state, corrected.corrected_at
        since_last_fix, since_this_fix = now - state.fused_at, now - corrected.fused_at
        pending_fraction = pending_correction_fraction(constants.predictor_ms, state, now)
        horizontal = _with_pending(
            state.horizontal,
            corrected.horizontal,
            propagated_horizontal_errors(constants, state, truth, since_last_fix),
            propagated_horizontal_errors(constants, corrected, truth, since_this_fix),
            pending_fraction,
        )
        vertical = _with_pending(
            state.vertical,
            corrected.vertical,
            propagated_vertical_errors(constants, state, truth, since_last_fix),
            propagated_vertical_errors(constants, corrected, truth, since_this_fix),
            pending_fraction,
        )
        return corrected._replace(horizontal=horizontal, vertical=vertical)

    def _next_yaw_noise(self) -> float:
        """Return the slow noise of the heading at the next fix, rad."""
        noise = self.state.yaw - self.state.noiseless_yaw
        deviation = radians(self._config.yaw_error_deg)
        return next_slow_noise(self._random, noise, deviation, self._yaw_decay)

    def _noiseless_yaw(self, velocity: complex, acceleration: complex, elapsed: float) -> float:
        """Return the next heading error without its noise, rad.

        Without acceleration the heading follows the compass. With a horizontal acceleration it
        follows the fixes, which show the direction of the acceleration. In a turn this direction
        lags, because the fixes are late.
        """
        config, compass_correction_rate = self._config, 1.0 / _COMPASS_TIME_S
        cross_product = (velocity.conjugate() * acceleration).imag
        turn_rate = cross_product / max(abs(velocity) ** 2, _MIN_COURSE_SPEED**2)
        fix_correction_rate = self._uncertainty * abs(acceleration) ** 2
        total_rate = compass_correction_rate + fix_correction_rate
        numerator = compass_correction_rate * radians(config.compass_error_deg)
        numerator -= fix_correction_rate * turn_rate * config.turn_yaw_ms * 1e-3
        steady_error = numerator / total_rate
        uncertainty = self._uncertainty / (1.0 + fix_correction_rate * elapsed)
        self._uncertainty = min(uncertainty + _UNCERTAINTY_GROWTH * elapsed, _MAX_UNCERTAINTY)
        return steady_error + (self.state.noiseless_yaw - steady_error) * exp(-total_rate * elapsed)

    def _next_noise(self, noise: tuple[complex, complex], ratio: float) -> tuple[complex, complex]:
        """Return the noise of the next fix after `noise`; `ratio`: see `_initial_errors`."""
        decay = self._noise_decay
        position, velocity = self._draw_noise(ratio * sqrt(1.0 - decay * decay))
        return decay * noise[0] + position, decay * noise[1] + velocity

    def _draw_noise(self, ratio: float) -> tuple[complex, complex]:
        """Draw white noise of position (m) and velocity (m/s): configured noise times `ratio`."""
        config, gauss = self._config, self._random.gauss
        sigma_p, sigma_v = ratio * config.position_noise_m, ratio * config.velocity_noise_m_s
        return (
            complex(gauss(0.0, sigma_p), gauss(0.0, sigma_p)),
            complex(gauss(0.0, sigma_v), gauss(0.0, sigma_v)),
        )

    def _corrected_state(
        self,
        errors: Errors,
        fix_errors: tuple[complex, complex],
        noise: tuple[complex, complex],
        tilt_noise: float,
    ) -> ErrorState:
        """Return the errors corrected by a fix whose own errors are `fix_errors`.

        A random tilt error is added, with the standard deviation `tilt_noise`, m/s^2 (tilt * g).
        """
        position, velocity, tilt = errors
        innovations = fix_errors[0] - position, fix_errors[1] - velocity
        to_position, to_velocity, to_tilt = (
            position_gain * innovations[0] + velocity_gain * innovations[1]
            for position_gain, velocity_gain in self._gains
        )
        gauss = self._random.gauss
        random_walk = complex(gauss(0.0, tilt_noise), gauss(0.0, tilt_noise))
        corrected = position + to_position, velocity + to_velocity, tilt + to_tilt + random_walk
        return ErrorState(corrected, (0j, 0j), noise)


def _with_pending(
    before: ErrorState, corrected: ErrorState, old: Errors, new: Errors, fraction: float
) -> ErrorState:
    """Return the corrected errors with pending corrections that keep the output continuous.

    Args:
        before: the errors before the fix.
        corrected: the errors after the fix.
        old: `before`, propagated from its own fix to the present.
        new: `corrected`, propagated from its fix to the present.
        fraction: fraction of the pending corrections of `before` that the output still lacks.
    """
    position, velocity = before.pending_corrections
    pending = (fraction * position + new[0] - old[0], fraction * velocity + new[1] - old[1])
    return corrected._replace(pending_corrections=pending)
