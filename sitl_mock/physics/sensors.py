"""The autopilot's estimate: the true motion with delay, noise, filter error, estimator resets."""

from collections import deque
from math import radians
from random import Random
from typing import NamedTuple

from sitl_mock.config.sensors import SensorConfig
from sitl_mock.physics.navigation_filter import NavigationError, NavigationFilter, Snapshot
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


class Estimator:
    """Computes the estimate; one seeded generator draws its white noise.

    Only `estimate` draws white noise, and always the same number of draws. So the noise depends on
    the seed and the number of calls; that of the navigation filter on the seed and the time.
    """

    __slots__ = (
        "_attitude_delay",
        "_config",
        "_dt",
        "_filter",
        "_gravity",
        "_history",
        "_horizon",
        "_offset",
        "_position_delay",
        "_random",
        "_rotation",
        "_yaw",
        "reset_counter",
    )

    def __init__(
        self, config: SensorConfig, start: Snapshot, *, gravity: float, dt: float, seed: int
    ) -> None:
        self._config = config
        self._gravity = gravity
        self._attitude_delay = round(config.attitude_delay_ms * 1e-3 / dt)
        self._position_delay = round(config.position_delay_ms * 1e-3 / dt)
        self._filter = None if config.ekf is None else NavigationFilter(config.ekf, start, seed)
        self._horizon = 0 if config.ekf is None else round(config.ekf.fix_delay_ms * 1e-3 / dt)
        length = 1 + max(self._attitude_delay, self._position_delay, self._horizon)
        self._history = deque([start] * length, maxlen=length)
        self._dt = dt
        self._random = Random(f"{seed}/sensors")
        self._yaw: Quaternion = (1.0, 0.0, 0.0, 0.0)
        self._rotation: Vector = (0.0, 0.0, 0.0)
        self._offset: Vector = (0.0, 0.0, 0.0)
        self.reset_counter = 0
        """Estimator resets since boot."""

    def record(self, snapshot: Snapshot) -> None:
        """Record the true motion after a physics step."""
        self._history.append(snapshot)

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

    def estimate(self, time: float) -> Estimate:
        """Return the estimate at ``time`` (s), which is now, with fresh noise."""
        config = self._config
        error = self._error(time)
        self._rotation = error.rotation
        attitude = self._history[-1 - self._attitude_delay]
        _, _, _, w, x, y, z, *rates = attitude.motion
        n, e, d = attitude.acceleration
        force = to_body((w, x, y, z), (n, e, d - self._gravity))
        place = self._history[-1 - self._position_delay]
        n, e, d = _add(place.position, error.position)
        off_n, off_e, off_d = self._offset
        turn_x, turn_y, turn_z = self._noise(0.5 * radians(config.attitude_noise_deg))
        turned = multiply(self.as_estimated((w, x, y, z)), (1.0, turn_x, turn_y, turn_z))
        gyro = _add((rates[0], rates[1], rates[2]), self._noise(config.rate_noise_rad_s))
        return Estimate(
            normalise(turned),
            gyro,
            _add((n + off_n, e + off_e, d + off_d), self._noise(config.position_noise_m)),
            _add(_add(place.motion[:3], error.velocity), self._noise(config.velocity_noise_m_s)),
            _add(force, self._noise(config.acceleration_noise_m_s2)),
            gyro,
        )

    def _error(self, time: float) -> NavigationError:
        """Return the error of the navigation filter at the age of position and velocity."""
        if self._filter is None:
            return _NO_ERROR
        behind = max(self._horizon, self._position_delay)
        self._filter.advance(self._history[-1 - behind], time - behind * self._dt, time)
        age = self._position_delay * self._dt
        return self._filter.error(self._history[-1 - self._position_delay], time - age)

    def _noise(self, deviation: float) -> Vector:
        gauss = self._random.gauss
        return (gauss(0.0, deviation), gauss(0.0, deviation), gauss(0.0, deviation))


def _add(left: Vector, right: Vector) -> Vector:
    return (left[0] + right[0], left[1] + right[1], left[2] + right[2])
