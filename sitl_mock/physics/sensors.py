"""The autopilot's estimate: the true motion with delay, noise, filter error, estimator resets."""

from collections.abc import Callable, Sequence
from math import cos, log, pi, radians, sin, sqrt
from random import Random
from typing import NamedTuple

from sitl_mock.config.sensors import SensorConfig
from sitl_mock.physics.navigation_filter import (
    NavigationError,
    NavigationFilter,
    Snapshot,
    TrailRow,
    snapshot,
)
from sitl_mock.physics.quaternion import Quaternion, Vector, from_yaw, multiply, normalise, to_body

_NO_ERROR = NavigationError((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


class Estimate(NamedTuple):
    """The autopilot's estimate. SI; world NED (origin: home on the ground), body FRD."""

    q: Quaternion
    body_rates: Vector  # rad/s
    position_ned: Vector  # m
    velocity_ned: Vector  # m/s
    specific_force_frd: Vector  # m/s^2, what an accelerometer measures
    gyro: Vector  # rad/s, what the (bias-free) gyro measures


class WhiteNoise:
    """Standard normal numbers: the sequence of `Random.gauss` (Box-Muller), many at a time.

    Args:
        seed: of the sequence.
    """

    __slots__ = ("_next", "_random")

    def __init__(self, seed: str) -> None:
        self._random = Random(seed)
        self._next: list[float] = []

    def draw(self, count: int) -> list[float]:
        """Return the next `count` numbers."""
        drawn, random = self._next, self._random.random
        while len(drawn) < count:
            angle = random() * 2.0 * pi
            radius = sqrt(-2.0 * log(1.0 - random()))
            drawn.append(cos(angle) * radius)
            drawn.append(sin(angle) * radius)
        self._next = drawn[count:]
        return drawn[:count]


class Estimator:
    """Computes the estimate; one seeded generator draws its white noise.

    Only `estimate` draws white noise, and always the same number of draws. So the noise depends on
    the seed and the number of calls; that of the navigation filter on the seed and the time.
    """

    __slots__ = (
        "_attitude_delay",
        "_deviations",
        "_dt",
        "_filter",
        "_gravity",
        "_horizon",
        "_noise",
        "_offset",
        "_position_delay",
        "_rotation",
        "_yaw",
        "reset_counter",
        "trail_length",
    )

    def __init__(
        self, config: SensorConfig, start: Snapshot, *, gravity: float, dt: float, seed: int
    ) -> None:
        self._deviations = tuple(
            deviation
            for deviation in (
                0.5 * radians(config.attitude_noise_deg),
                config.rate_noise_rad_s,
                config.position_noise_m,
                config.velocity_noise_m_s,
                config.acceleration_noise_m_s2,
            )
            for _ in range(3)
        )
        self._gravity = gravity
        self._attitude_delay = round(config.attitude_delay_ms * 1e-3 / dt)
        self._position_delay = round(config.position_delay_ms * 1e-3 / dt)
        self._filter = None if config.ekf is None else NavigationFilter(config.ekf, start, seed)
        self._horizon = 0 if config.ekf is None else round(config.ekf.fix_delay_ms * 1e-3 / dt)
        self.trail_length = 1 + max(self._attitude_delay, self._position_delay, self._horizon)
        """Steps whose motion an estimate needs, the present one included."""
        self._dt = dt
        self._noise = WhiteNoise(f"{seed}/sensors")
        self._yaw: Quaternion = (1.0, 0.0, 0.0, 0.0)
        self._rotation: Vector = (0.0, 0.0, 0.0)
        self._offset: Vector = (0.0, 0.0, 0.0)
        self.reset_counter = 0
        """Estimator resets since boot."""

    def shift(self, yaw: float, position_ned: Vector) -> None:
        """Reset the estimator: rotate (rad) and shift (m) the estimate from now on."""
        self._yaw = multiply(from_yaw(yaw), self._yaw)
        n, e, d = self._offset
        self._offset = (n + position_ned[0], e + position_ned[1], d + position_ned[2])
        self.reset_counter += 1

    def as_estimated(self, q: Quaternion) -> Quaternion:
        """Return a true attitude with the attitude error of the latest estimate."""
        roll, pitch, heading = self._rotation
        tilted = multiply((1.0, 0.5 * roll, 0.5 * pitch, 0.5 * heading), q)
        return multiply(self._yaw, tilted)

    def estimate(self, time: float, before: Callable[[int], TrailRow]) -> Estimate:
        """Return the estimate at ``time`` (s), which is now, with fresh noise.

        Args:
            time: now, s.
            before: returns the true motion that many steps ago, fewer than `trail_length`.
        """
        attitude, place = before(self._attitude_delay), before(self._position_delay)
        error = self._error(time, place, before)
        self._rotation = error.rotation
        _, _, _, w, x, y, z, p, q, r, _, _, _, n, e, d = attitude
        force = to_body((w, x, y, z), (n, e, d - self._gravity))
        noise = [0.0 + z * s for z, s in zip(self._noise.draw(15), self._deviations, strict=True)]
        turn_x, turn_y, turn_z, p_noise, q_noise, r_noise, *rest = noise
        turned = multiply(self.as_estimated((w, x, y, z)), (1.0, turn_x, turn_y, turn_z))
        gyro = (p + p_noise, q + q_noise, r + r_noise)
        return Estimate(
            normalise(turned),
            gyro,
            _sum(place[10:13], error.position, self._offset, rest[0:3]),
            _sum(place, error.velocity, rest[3:6]),
            _sum(force, rest[6:9]),
            gyro,
        )

    def _error(
        self, time: float, place: TrailRow, before: Callable[[int], TrailRow]
    ) -> NavigationError:
        """Return the error of the navigation filter at the age of position and velocity."""
        if self._filter is None:
            return _NO_ERROR
        behind = max(self._horizon, self._position_delay)
        fused = time - behind * self._dt
        if self._filter.is_due(fused):
            self._filter.advance(snapshot(before(behind)), fused, time)
        return self._filter.error(snapshot(place), time - self._position_delay * self._dt)


def _sum(first: Sequence[float], *others: Sequence[float]) -> Vector:
    """Return the sum of the first three components of vectors, added from left to right."""
    x, y, z = first[0], first[1], first[2]
    for other in others:
        x, y, z = x + other[0], y + other[1], z + other[2]
    return x, y, z
