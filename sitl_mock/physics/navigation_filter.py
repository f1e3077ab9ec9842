"""The error of an autopilot's navigation filter, which is smooth and lasts for seconds.

The filter integrates the inertial sensor at a delayed fusion time and corrects itself there by
satellite fixes. We compute only its error. The error is linear and has a closed form between two
fixes, so we update it at fixes only. Horizontal vectors are complex numbers, north + j east.
"""

from math import exp, radians, sqrt
from random import Random

from sitl_mock.config.sensors import EkfConfig
from sitl_mock.physics.navigation_error import (
    ErrorLaw,
    Errors,
    FilterState,
    TrackState,
    TruthRow,
    pending_share,
    propagated_horizontal,
    propagated_vertical,
)
from sitl_mock.physics.rigid_body import GRAVITY

_SAG_TIME_S = 2.0
"""Time constant with which errors of height and climb follow the acceleration, s."""
_MIN_COURSE_SPEED = 0.5
"""Smallest speed for which the turn rate of the course is computed, m/s; the course of a slower
vehicle would seem to turn infinitely fast."""
_COMPASS_TIME_S = 20.0
"""Time constant with which the heading follows the compass without acceleration, s."""
_LARGEST_UNCERTAINTY = 0.1
"""Uncertainty of the heading after a long time without acceleration, s^3/m^2. Times the squared
acceleration it is the rate, 1/s, at which fixes correct the heading. Fixes reduce it as in a Kalman
filter."""
_UNCERTAINTY_GROWTH = 0.0002
"""Growth of the uncertainty, s^2/m^2."""


class NavigationFilter:
    """Computes the errors from fix to fix.

    Args:
        config: noise, delays and gains.
        start: the true motion at time 0.
        seed: seed of the noise.

    Attributes:
        law: constants between two fixes.
        state: errors after the latest fix.
    """

    def __init__(self, config: EkfConfig, start: TruthRow, seed: int) -> None:
        self._config = config
        self._period = config.fix_period_ms * 1e-3
        self._gains = (config.position_gains, config.velocity_gains, config.acceleration_gains)
        self._decay = exp(-self._period / config.noise_time_s)
        self._yaw_decay = exp(-self._period / config.yaw_time_s)
        self.law = ErrorLaw(
            config.acceleration_lead_ms * 1e-3,
            config.acceleration_scale,
            complex(*map(radians, config.tilt_bias_deg)),
            config.height_offset_m,
            config.predictor_ms,
            config.heading_predictor_ms,
        )
        self._uncertainty = _LARGEST_UNCERTAINTY
        self._random = Random(f"{seed}/navigation")
        self._height_random = Random(f"{seed}/height")
        self._slipped = Random(f"{seed}/slip").random()
        yaw = self._random.gauss(0.0, radians(config.yaw_error_deg))
        horizontal, vertical = self._initial(1.0), self._initial(config.vertical_share)
        place, speed = complex(start[10], start[11]), complex(start[0], start[1])
        noise = self._height_random.gauss(0.0, config.height_noise_m)
        self.state = FilterState(
            horizontal, vertical, yaw, 0.0, 0.0, noise, 0.0, noise, 0.0, 0.0, place, speed
        )

    def _initial(self, share: float) -> TrackState:
        """Return the state after the first fix, whose noise becomes the error."""
        config, gauss = self._config, self._random.gauss
        place, speed = share * config.position_noise_m, share * config.velocity_noise_m_s
        noise = (
            complex(gauss(0.0, place), gauss(0.0, place)),
            complex(gauss(0.0, speed), gauss(0.0, speed)),
        )
        return TrackState((*noise, 0j), (0j, 0j), noise)

    def is_due(self, at: float) -> bool:
        """Whether a fix is due at a fusion time, s."""
        return at - self.state.fused_at >= self._period - 1e-9

    def advance(self, delayed: TruthRow, at: float, present: TruthRow, now: float) -> None:
        """Correct the errors by a fix; the output follows gradually, without a jump.

        Args:
            delayed: the true motion at the fusion time.
            at: the fusion time, s.
            present: the true motion now.
            now: the present time, s.
        """
        config, law, state = self._config, self.law, self.state
        elapsed = at - state.fused_at
        velocity = complex(delayed[0], delayed[1])
        acceleration = complex(delayed[13], delayed[14])
        errors = propagated_horizontal(law, state, delayed, elapsed)
        noise = self._next_noise(state.horizontal.noise, 1.0)
        slip = config.fix_slip_ms * (0.5 - (at / config.fix_slip_time_s + self._slipped) % 1.0)
        seen = (
            noise[0] - ((config.position_late_ms + slip) * 1e-3 + law.lead) * velocity,
            noise[1] - ((config.velocity_late_ms + slip) * 1e-3 + law.lead) * acceleration,
        )
        kick = GRAVITY * radians(config.tilt_noise_deg) * sqrt(elapsed)
        horizontal = self._corrected_state(errors, seen, noise, kick)
        share = config.vertical_share
        noise = self._next_noise(state.vertical.noise, share)
        errors = propagated_vertical(law, state, delayed, elapsed)
        vertical = self._corrected_state(errors, noise, noise, share * kick)
        noiseless_yaw = self._next_alignment(velocity, acceleration, elapsed)
        yaw = self._next_yaw_noise() + noiseless_yaw
        turning = pending_share(law.heading_predictor_ms, state, now)
        yaw_pending = turning * state.yaw_pending + yaw - state.yaw
        height_noise = self._next_height_noise(elapsed)
        sag, sink = self._next_sag(abs(acceleration), height_noise, elapsed)
        corrected = FilterState(
            horizontal,
            vertical,
            yaw,
            yaw_pending,
            noiseless_yaw,
            sag,
            sink,
            height_noise,
            at,
            now,
            complex(delayed[10], delayed[11]),
            velocity,
        )
        self.state = self._without_jump(corrected, present)

    def _without_jump(self, corrected: FilterState, present: TruthRow) -> FilterState:
        """Return the corrected state with pending corrections that keep the output as it was."""
        law, state, now = self.law, self.state, corrected.corrected_at
        since, ago = now - state.fused_at, now - corrected.fused_at
        unsettled = pending_share(law.predictor_ms, state, now)
        horizontal = _settling(
            state.horizontal,
            corrected.horizontal,
            propagated_horizontal(law, state, present, since),
            propagated_horizontal(law, corrected, present, ago),
            unsettled,
        )
        vertical = _settling(
            state.vertical,
            corrected.vertical,
            propagated_vertical(law, state, present, since),
            propagated_vertical(law, corrected, present, ago),
            unsettled,
        )
        return corrected._replace(horizontal=horizontal, vertical=vertical)

    def _next_yaw_noise(self) -> float:
        """Return the slow noise of the heading at the next fix, rad."""
        config, kept = self._config, self._yaw_decay
        spread = radians(config.yaw_error_deg) * sqrt(1.0 - kept * kept)
        return kept * (self.state.yaw - self.state.noiseless_yaw) + self._random.gauss(0.0, spread)

    def _next_alignment(self, velocity: complex, acceleration: complex, elapsed: float) -> float:
        """Return the next heading error without its noise, rad.

        Without acceleration the heading follows the compass. In a horizontal acceleration it
        follows the fixes, because they measure its direction. In a turn, late fixes lag behind it.
        """
        config, slow = self._config, 1.0 / _COMPASS_TIME_S
        across = (velocity.conjugate() * acceleration).imag
        turn_rate = across / max(abs(velocity) ** 2, _MIN_COURSE_SPEED**2)
        shown = self._uncertainty * abs(acceleration) ** 2
        rate = slow + shown
        wrong = slow * radians(config.compass_error_deg)
        wrong -= shown * turn_rate * config.turn_yaw_ms * 1e-3
        rest = wrong / rate
        left = self._uncertainty / (1.0 + shown * elapsed)
        self._uncertainty = min(left + _UNCERTAINTY_GROWTH * elapsed, _LARGEST_UNCERTAINTY)
        return rest + (self.state.noiseless_yaw - rest) * exp(-rate * elapsed)

    def _next_sag(
        self, acceleration: float, height_noise: float, elapsed: float
    ) -> tuple[float, float]:
        """Return the slow errors of the down position (m) and velocity (m/s) at the next fix."""
        config, state = self._config, self.state
        sag = config.height_sag_s4_per_m * acceleration**2 + height_noise
        sink = config.sink_per_acceleration_ms * 1e-3 * acceleration
        share = 1.0 - exp(-elapsed / _SAG_TIME_S)
        return state.sag + share * (sag - state.sag), state.sink + share * (sink - state.sink)

    def _next_height_noise(self, elapsed: float) -> float:
        """Return the slow noise of the height at the next fix, m."""
        config, kept = self._config, exp(-elapsed / self._config.height_noise_time_s)
        spread = config.height_noise_m * sqrt(1.0 - kept * kept)
        return kept * self.state.height_noise + self._height_random.gauss(0.0, spread)

    def _next_noise(self, noise: tuple[complex, complex], share: float) -> tuple[complex, complex]:
        """Return the noise of the next fix."""
        config, gauss, decay = self._config, self._random.gauss, self._decay
        fresh = share * sqrt(1.0 - decay * decay)
        place, speed = config.position_noise_m * fresh, config.velocity_noise_m_s * fresh
        return (
            decay * noise[0] + complex(gauss(0.0, place), gauss(0.0, place)),
            decay * noise[1] + complex(gauss(0.0, speed), gauss(0.0, speed)),
        )

    def _corrected_state(
        self,
        errors: Errors,
        seen: tuple[complex, complex],
        noise: tuple[complex, complex],
        kick: float,
    ) -> TrackState:
        """Return the errors corrected by a fix whose own errors are `seen`.

        A random tilt error is added; `kick`, m/s^2 of acceleration, is its standard deviation.
        """
        place, speed, tilt = errors
        off, faster = seen[0] - place, seen[1] - speed
        first, second, third = (
            of_place * off + of_speed * faster for of_place, of_speed in self._gains
        )
        gauss = self._random.gauss
        wander = complex(gauss(0.0, kick), gauss(0.0, kick))
        corrected = place + first, speed + second, tilt + third + wander
        return TrackState(corrected, (0j, 0j), noise)


def _settling(
    before: TrackState, corrected: TrackState, old: Errors, new: Errors, unsettled: float
) -> TrackState:
    """Return a corrected track whose output goes on from where it was.

    Args:
        before: the track before the fix.
        corrected: the track after it.
        old: present errors by the track before the fix.
        new: present errors by the track after it.
        unsettled: share of the corrections of `before` that its output does not contain.
    """
    place, speed = before.pending
    return corrected._replace(
        pending=(unsettled * place + new[0] - old[0], unsettled * speed + new[1] - old[1])
    )
