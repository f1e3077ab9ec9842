"""The error of an autopilot's navigation filter: smooth, and lasting for seconds.

The filter integrates its inertial sensor at a delayed horizon and corrects itself there by
satellite fixes. Only its error is followed, which is linear and moves on at fixes alone: between
two of them it has a closed form. Horizontal vectors are complex numbers, north + j east.
"""

from math import exp, radians, sqrt
from random import Random
from typing import NamedTuple

from sitl_mock.config.sensors import EkfConfig
from sitl_mock.physics.quaternion import Vector
from sitl_mock.physics.rigid_body import Motion

_GRAVITY = 9.80665
_SAG_S = 2.0
"""The height's error follows the acceleration with this time constant, s."""
_SLOW = 0.5
"""Below this speed, m/s, the course tells nothing of the heading."""
Errors = tuple[complex, complex, complex]
"""Of position (m), velocity (m/s) and acceleration (m/s^2, by the attitude's roll and pitch)."""


class Snapshot(NamedTuple):
    """The true motion at the end of one physics step."""

    motion: Motion
    position: Vector
    acceleration: Vector  # NED, m/s^2, mean over the step


class NavigationError(NamedTuple):
    """How far the estimate is off: m, m/s, and a small rotation of the attitude, rad, NED."""

    position: Vector
    velocity: Vector
    rotation: Vector


class _Track(NamedTuple):
    """What a fix leaves behind, of the plane or of the vertical direction."""

    errors: Errors
    pending: tuple[complex, complex]
    """What the output still lacks of the corrections of position and velocity."""
    noise: tuple[complex, complex]
    """Of the latest fix's position and velocity."""


class NavigationFilter:
    """The errors, from fix to fix.

    Args:
        config: the filter's.
        start: where the vehicle stands at the time 0.
        seed: of its noise.
    """

    __slots__ = (
        "_at",
        "_config",
        "_corrected",
        "_decay",
        "_fixed",
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
        self._fixed = start
        self._corrected = self._sag = 0.0
        self._level, self._upright = self._begun(1.0), self._begun(config.vertical_share)

    def _begun(self, share: float) -> _Track:
        """The first fix is believed as it comes."""
        config, gauss = self._config, self._random.gauss
        place, speed = share * config.position_noise_m, share * config.velocity_noise_m_s
        noise = (
            complex(gauss(0.0, place), gauss(0.0, place)),
            complex(gauss(0.0, speed), gauss(0.0, speed)),
        )
        return _Track((*noise, 0j), (0j, 0j), noise)

    def advance(self, delayed: Snapshot, at: float, now: float) -> None:
        """Correct the filter if a fix is due: the motion at its horizon, and both times, s."""
        if at - self._at < self._period - 1e-9:
            return
        elapsed = at - self._at
        config, late = self._config, 1e-3
        speed, pull = _plane(delayed.motion), _plane(delayed.acceleration)
        moved = self._carried(delayed, elapsed)
        noise = self._shaken(self._level.noise, 1.0)
        seen = (
            noise[0] - (config.position_late_ms * late + self._lead) * speed,
            noise[1] - (config.velocity_late_ms * late + self._lead) * pull,
        )
        settled = exp((self._corrected - now) * 1e3 / config.predictor_ms)
        kick = _GRAVITY * radians(config.tilt_noise_deg) * sqrt(elapsed)
        level = self._corrected_by(self._level, moved, seen, noise, settled, kick)
        share = config.vertical_share
        noise = self._shaken(self._upright.noise, share)
        still = _moved_on(self._upright.errors, elapsed)
        upright = self._corrected_by(self._upright, still, noise, noise, settled, share * kick)
        self._turn(speed, pull)
        sag = config.height_sag_s4_per_m * abs(pull) ** 2
        self._sag += (1.0 - exp(-elapsed / _SAG_S)) * (sag - self._sag)
        self._level, self._upright = level, upright
        self._at, self._fixed, self._corrected = at, delayed, now

    def error(self, truth: Snapshot, now: float) -> NavigationError:
        """The error now, s, of the motion that is true now."""
        elapsed = now - self._at
        settled = exp((self._corrected - now) * 1e3 / self._config.predictor_ms)
        place, speed, tilt = self._carried(truth, elapsed)
        pending = self._level.pending
        place += self._lead * _plane(truth.motion) - settled * pending[0]
        speed += self._lead * _plane(truth.acceleration) - settled * pending[1]
        down, sink, _ = _moved_on(self._upright.errors, elapsed)
        pending = self._upright.pending
        down += self._config.height_offset_m + self._sag - settled * pending[0]
        return NavigationError(
            (place.real, place.imag, down.real),
            (speed.real, speed.imag, (sink - settled * pending[1]).real),
            # Thrust along the wrong axis is what makes the acceleration wrong.
            (tilt.imag / _GRAVITY, -tilt.real / _GRAVITY, self._yaw),
        )

    def _turn(self, speed: complex, pull: complex) -> None:
        """The heading's error wanders, and follows the course's turn rate."""
        config, decay = self._config, self._yaw_decay
        spread = radians(config.yaw_error_deg) * sqrt(1.0 - decay**2)
        turn_rate = (speed.conjugate() * pull).imag / max(abs(speed) ** 2, _SLOW**2)
        learned = -turn_rate * config.turn_yaw_ms * 1e-3
        self._yaw = learned + decay * (self._yaw - learned) + self._random.gauss(0.0, spread)

    def _carried(self, truth: Snapshot, elapsed: float) -> Errors:
        """The plane's errors so long after the fix: a turned and scaled motion is integrated."""
        place, speed, tilt = _moved_on(self._level.errors, elapsed)
        wrong = complex(self._config.acceleration_scale, self._yaw)
        before = _plane(self._fixed.motion)
        way = _plane(truth.position) - _plane(self._fixed.position)
        return (
            place + wrong * (way - elapsed * before),
            speed + wrong * (_plane(truth.motion) - before),
            tilt,
        )

    def _shaken(self, noise: tuple[complex, complex], share: float) -> tuple[complex, complex]:
        """The noise of the next fix."""
        config, gauss, decay = self._config, self._random.gauss, self._decay
        fresh = share * sqrt(1.0 - decay * decay)
        place, speed = config.position_noise_m * fresh, config.velocity_noise_m_s * fresh
        return (
            decay * noise[0] + complex(gauss(0.0, place), gauss(0.0, place)),
            decay * noise[1] + complex(gauss(0.0, speed), gauss(0.0, speed)),
        )

    def _corrected_by(
        self,
        track: _Track,
        errors: Errors,
        seen: tuple[complex, complex],
        noise: tuple[complex, complex],
        settled: float,
        kick: float,
    ) -> _Track:
        """Correct errors by a fix whose own errors are `seen`; then the attitude wanders."""
        place, speed, tilt = errors
        off, faster = seen[0] - place, seen[1] - speed
        first, second, third = (
            of_place * off + of_speed * faster for of_place, of_speed in self._gains
        )
        gauss = self._random.gauss
        wander = complex(gauss(0.0, kick), gauss(0.0, kick))
        pending = track.pending
        return _Track(
            (place + first, speed + second, tilt + third + wander),
            (settled * pending[0] + first, settled * pending[1] + second),
            noise,
        )


def _plane(vector: tuple[float, ...]) -> complex:
    """North + j east of a vector that begins with them."""
    return complex(vector[0], vector[1])


def _moved_on(errors: Errors, elapsed: float) -> Errors:
    """Errors that nothing new adds to, so long later, s."""
    place, speed, tilt = errors
    return place + elapsed * (speed + 0.5 * elapsed * tilt), speed + elapsed * tilt, tilt
