"""The error of an autopilot's navigation filter, which is smooth and lasts for seconds.

The filter integrates the inertial sensor at a delayed fusion time and corrects itself there by
satellite fixes. We compute only its error. The error is linear and has a closed form between two
fixes, so we update it at fixes only. Horizontal vectors are complex numbers, north + j east.
"""

from math import exp, radians, sqrt
from random import Random
from typing import NamedTuple

from sitl_mock.config.sensors import EkfConfig
from sitl_mock.physics.quaternion import Vector
from sitl_mock.physics.rigid_body import Motion

_GRAVITY = 9.80665
_SAG_S = 2.0
"""Time constant with which the height error follows the acceleration, s."""
_SLOW = 0.5
"""Below this speed, m/s, the course does not correct the heading."""
Errors = tuple[complex, complex, complex]
"""Errors of position (m), velocity (m/s), acceleration (m/s^2, from errors of roll and pitch)."""


class Snapshot(NamedTuple):
    """The true motion after one physics step."""

    motion: Motion
    position: Vector
    acceleration: Vector  # NED, m/s^2, mean over the step


TrailRow = tuple[*Motion, *Vector, *Vector]
"""A snapshot as one row of numbers: motion, position, acceleration."""


def snapshot(row: TrailRow) -> Snapshot:
    """Return the true motion of a row."""
    return Snapshot(row[0:10], row[10:13], row[13:16])


class NavigationError(NamedTuple):
    """Error of the estimate: m, m/s, and a small rotation of the attitude, rad, NED."""

    position: Vector
    velocity: Vector
    rotation: Vector


class _FilterState(NamedTuple):
    """Errors after a fix, horizontal or vertical."""

    errors: Errors
    pending: tuple[complex, complex]
    """Corrections of position and velocity that the output does not yet contain."""
    noise: tuple[complex, complex]
    """Noise of the latest fix: position and velocity."""


class NavigationFilter:
    """Computes the errors from fix to fix.

    Args:
        config: noise, delays and gains.
        start: the true motion at time 0.
        seed: of the noise.
    """

    __slots__ = (
        "_at",
        "_config",
        "_corrected",
        "_decay",
        "_fixed_speed",
        "_fixed_way",
        "_gains",
        "_lead",
        "_level",
        "_period",
        "_random",
        "_sag",
        "_upright",
        "_yaw",
        "_yaw_decay",
    )

    def __init__(self, config: EkfConfig, start: Snapshot, seed: int) -> None:
        self._config = config
        self._period = config.fix_period_ms * 1e-3
        self._gains = (config.position_gains, config.velocity_gains, config.acceleration_gains)
        self._decay = exp(-self._period / config.noise_time_s)
        self._yaw_decay = exp(-self._period / config.yaw_time_s)
        self._lead = config.acceleration_lead_ms * 1e-3
        self._random = Random(f"{seed}/navigation")
        self._yaw = self._random.gauss(0.0, radians(config.yaw_error_deg))
        self._at = 0.0
        self._fixed_way, self._fixed_speed = _horizontal(start.position), _horizontal(start.motion)
        self._corrected = self._sag = 0.0
        self._level, self._upright = self._initial(1.0), self._initial(config.vertical_share)

    def _initial(self, share: float) -> _FilterState:
        """Return the state after the first fix, whose noise becomes the error."""
        config, gauss = self._config, self._random.gauss
        place, speed = share * config.position_noise_m, share * config.velocity_noise_m_s
        noise = (
            complex(gauss(0.0, place), gauss(0.0, place)),
            complex(gauss(0.0, speed), gauss(0.0, speed)),
        )
        return _FilterState((*noise, 0j), (0j, 0j), noise)

    def is_due(self, at: float) -> bool:
        """Whether a fix is due at a fusion time, s."""
        return at - self._at >= self._period - 1e-9

    def advance(self, delayed: Snapshot, at: float, now: float) -> None:
        """Correct the errors by a fix.

        Args:
            delayed: the true motion at the fusion time.
            at: the fusion time, s.
            now: the present time, s.
        """
        elapsed = at - self._at
        config, late = self._config, 1e-3
        speed, pull = _horizontal(delayed.motion), _horizontal(delayed.acceleration)
        moved = self._propagated(delayed, elapsed)
        noise = self._next_noise(self._level.noise, 1.0)
        seen = (
            noise[0] - (config.position_late_ms * late + self._lead) * speed,
            noise[1] - (config.velocity_late_ms * late + self._lead) * pull,
        )
        settled = exp((self._corrected - now) * 1e3 / config.predictor_ms)
        kick = _GRAVITY * radians(config.tilt_noise_deg) * sqrt(elapsed)
        level = self._corrected_state(self._level, moved, seen, noise, settled, kick)
        share = config.vertical_share
        noise = self._next_noise(self._upright.noise, share)
        still = _extrapolated(self._upright.errors, elapsed)
        upright = self._corrected_state(self._upright, still, noise, noise, settled, share * kick)
        self._turn(speed, pull)
        sag = config.height_sag_s4_per_m * abs(pull) ** 2
        self._sag += (1.0 - exp(-elapsed / _SAG_S)) * (sag - self._sag)
        self._level, self._upright = level, upright
        self._at, self._corrected = at, now
        self._fixed_way, self._fixed_speed = _horizontal(delayed.position), speed

    def error(self, truth: Snapshot, now: float) -> NavigationError:
        """Return the error at ``now`` (s), at which the true motion is ``truth``."""
        elapsed = now - self._at
        settled = exp((self._corrected - now) * 1e3 / self._config.predictor_ms)
        place, speed, tilt = self._propagated(truth, elapsed)
        pending = self._level.pending
        place += self._lead * _horizontal(truth.motion) - settled * pending[0]
        speed += self._lead * _horizontal(truth.acceleration) - settled * pending[1]
        down, sink, _ = _extrapolated(self._upright.errors, elapsed)
        pending = self._upright.pending
        down += self._config.height_offset_m + self._sag - settled * pending[0]
        return NavigationError(
            (place.real, place.imag, down.real),
            (speed.real, speed.imag, (sink - settled * pending[1]).real),
            # A wrong attitude rotates the thrust, which makes the acceleration wrong.
            (tilt.imag / _GRAVITY, -tilt.real / _GRAVITY, self._yaw),
        )

    def _turn(self, speed: complex, pull: complex) -> None:
        """Update the heading error: coloured noise about a mean that follows the turn rate."""
        config, decay = self._config, self._yaw_decay
        spread = radians(config.yaw_error_deg) * sqrt(1.0 - decay**2)
        turn_rate = (speed.conjugate() * pull).imag / max(abs(speed) ** 2, _SLOW**2)
        learned = -turn_rate * config.turn_yaw_ms * 1e-3
        self._yaw = learned + decay * (self._yaw - learned) + self._random.gauss(0.0, spread)

    def _propagated(self, truth: Snapshot, elapsed: float) -> Errors:
        """Return the horizontal errors ``elapsed`` s after the fix.

        The filter integrated an acceleration that was rotated and scaled.
        """
        place, speed, tilt = _extrapolated(self._level.errors, elapsed)
        wrong = complex(self._config.acceleration_scale, self._yaw)
        before = self._fixed_speed
        way = _horizontal(truth.position) - self._fixed_way
        return (
            place + wrong * (way - elapsed * before),
            speed + wrong * (_horizontal(truth.motion) - before),
            tilt,
        )

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
        track: _FilterState,
        errors: Errors,
        seen: tuple[complex, complex],
        noise: tuple[complex, complex],
        settled: float,
        kick: float,
    ) -> _FilterState:
        """Return the errors corrected by a fix whose own errors are `seen`; add a random tilt."""
        place, speed, tilt = errors
        off, faster = seen[0] - place, seen[1] - speed
        first, second, third = (
            of_place * off + of_speed * faster for of_place, of_speed in self._gains
        )
        gauss = self._random.gauss
        wander = complex(gauss(0.0, kick), gauss(0.0, kick))
        pending = track.pending
        return _FilterState(
            (place + first, speed + second, tilt + third + wander),
            (settled * pending[0] + first, settled * pending[1] + second),
            noise,
        )


def _horizontal(vector: tuple[float, ...]) -> complex:
    """Return north + j east of a vector that starts with these two."""
    return complex(vector[0], vector[1])


def _extrapolated(errors: Errors, elapsed: float) -> Errors:
    """Return the errors ``elapsed`` s later, without new disturbances."""
    place, speed, tilt = errors
    return place + elapsed * (speed + 0.5 * elapsed * tilt), speed + elapsed * tilt, tilt
