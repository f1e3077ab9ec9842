"""What the autopilot believes: the truth, later, with noise, and shifted by estimator resets."""

from collections import deque
from math import radians
from random import Random
from typing import NamedTuple

from sitl_mock.config import SensorConfig
from sitl_mock.physics import Motion
from sitl_mock.quaternion import Quaternion, Vector, from_yaw, multiply, normalise, to_body


class Estimate(NamedTuple):
    """The autopilot's estimate. SI; world NED (origin: home on the ground), body FRD."""

    q: Quaternion
    body_rates: Vector  # rad/s
    position_ned: Vector  # m
    velocity_ned: Vector  # m/s
    specific_force_frd: Vector  # m/s^2, what an accelerometer measures
    gyro: Vector  # rad/s, what the (bias-free) gyro measures


class Snapshot(NamedTuple):
    """The true motion at the end of one physics step."""

    motion: Motion
    position: Vector
    acceleration: Vector  # NED, m/s^2, mean over the step


class Estimator:
    """Delayed, noisy view of the truth, with one seeded generator for its noise.

    Noise is drawn only by `estimate`, the same number of draws a call, so it depends on nothing
    but the seed and the number of calls.
    """

    __slots__ = (
        "_attitude_delay",
        "_config",
        "_gravity",
        "_history",
        "_offset",
        "_position_delay",
        "_random",
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
        length = 1 + max(self._attitude_delay, self._position_delay)
        self._history = deque([start] * length, maxlen=length)
        self._random = Random(f"{seed}/sensors")
        self._yaw: Quaternion = (1.0, 0.0, 0.0, 0.0)
        self._offset: Vector = (0.0, 0.0, 0.0)
        self.reset_counter = 0
        """Estimator resets since boot."""

    def record(self, snapshot: Snapshot) -> None:
        """Take in the truth after a physics step."""
        self._history.append(snapshot)

    def shift(self, yaw: float, position_ned: Vector) -> None:
        """An estimator reset: from now on the estimate is turned (rad) and moved (m) by this."""
        self._yaw = multiply(from_yaw(yaw), self._yaw)
        n, e, d = self._offset
        self._offset = (n + position_ned[0], e + position_ned[1], d + position_ned[2])
        self.reset_counter += 1

    def as_estimated(self, q: Quaternion) -> Quaternion:
        """A true attitude in the world as it is believed to lie."""
        return multiply(self._yaw, q)

    def estimate(self) -> Estimate:
        """The estimate now; draws fresh noise."""
        config = self._config
        attitude = self._history[-1 - self._attitude_delay]
        _, _, _, w, x, y, z, *rates = attitude.motion
        n, e, d = attitude.acceleration
        force = to_body((w, x, y, z), (n, e, d - self._gravity))
        place = self._history[-1 - self._position_delay]
        n, e, d = place.position
        off_n, off_e, off_d = self._offset
        turn_x, turn_y, turn_z = self._noise(0.5 * radians(config.attitude_noise_deg))
        turned = multiply(self.as_estimated((w, x, y, z)), (1.0, turn_x, turn_y, turn_z))
        gyro = _add((rates[0], rates[1], rates[2]), self._noise(config.rate_noise_rad_s))
        return Estimate(
            normalise(turned),
            gyro,
            _add((n + off_n, e + off_e, d + off_d), self._noise(config.position_noise_m)),
            _add(place.motion[:3], self._noise(config.velocity_noise_m_s)),
            _add(force, self._noise(config.acceleration_noise_m_s2)),
            gyro,
        )

    def _noise(self, deviation: float) -> Vector:
        gauss = self._random.gauss
        return (gauss(0.0, deviation), gauss(0.0, deviation), gauss(0.0, deviation))


def _add(left: Vector, right: Vector) -> Vector:
    return (left[0] + right[0], left[1] + right[1], left[2] + right[2])
