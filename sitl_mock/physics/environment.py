"""The environment: wind, and flat ground at the height of the start."""

from math import cos, exp, radians, sin, sqrt
from random import Random
from typing import NamedTuple

from sitl_mock.config.airframe import AirframeConfig, WindConfig
from sitl_mock.physics.quaternion import Quaternion, Vector, normalise


class Wind:
    """Wind with gusts, in steps of `dt` s. `velocity` is the velocity of the air, NED, m/s."""

    def __init__(self, config: WindConfig, dt: float, seed: int) -> None:
        direction = radians(config.from_deg)
        self._mean = (-config.speed_m_s * cos(direction), -config.speed_m_s * sin(direction))
        self._gust_decay = exp(-dt / config.gust_time_s)
        self._gust_noise = config.gust_m_s * sqrt(1.0 - self._gust_decay**2)
        self._vertical_gust_noise = config.vertical_gust_m_s * sqrt(1.0 - self._gust_decay**2)
        self._has_no_gusts = config.gust_m_s == 0.0 and config.vertical_gust_m_s == 0.0
        # A text seed gives the same numbers on every machine, independent of the other noises.
        self._random = Random(f"{seed}/wind")
        # Drawn from the stationary distribution, so that gusts do not start from zero.
        gauss = self._random.gauss
        self._gust: Vector = (
            gauss(0.0, config.gust_m_s),
            gauss(0.0, config.gust_m_s),
            gauss(0.0, config.vertical_gust_m_s),
        )
        self.velocity: Vector = self._mean_with_gust()

    def _mean_with_gust(self) -> Vector:
        north, east, down = self._gust
        return (self._mean[0] + north, self._mean[1] + east, down)

    def step(self) -> None:
        """Advance the gusts by `dt`."""
        if self._has_no_gusts:
            return
        gauss, decay = self._random.gauss, self._gust_decay
        north, east, down = self._gust
        self._gust = (
            decay * north + self._gust_noise * gauss(0.0, 1.0),
            decay * east + self._gust_noise * gauss(0.0, 1.0),
            decay * down + self._vertical_gust_noise * gauss(0.0, 1.0),
        )
        self.velocity = self._mean_with_gust()


class GroundConstants(NamedTuple):
    """Constants of the contact with the ground: no penetration, no sliding.

    The vehicle levels while it stands on the ground, unless it has crashed.
    """

    crash_cosine: float  # cosine of the tilt above which a touchdown is a crash
    crash_speed: float  # sink speed above which a touchdown is a crash, m/s
    levelling_factor: float  # factor on the tilt in one step on the ground


def ground_constants(airframe: AirframeConfig, dt: float) -> GroundConstants:
    """Return the constants of the contact with the ground for steps of `dt` seconds."""
    return GroundConstants(
        cos(radians(airframe.crash_tilt_deg)),
        airframe.crash_speed_m_s,
        exp(-dt * 1e3 / airframe.ground_levelling_ms),
    )


def survives_touchdown(constants: GroundConstants, q: Quaternion, sink_speed: float) -> bool:
    """Whether a touchdown at this attitude and sink speed (m/s) is not a crash."""
    _, x, y, _ = q
    is_upright = 1.0 - 2.0 * (x * x + y * y) >= constants.crash_cosine
    return is_upright and sink_speed <= constants.crash_speed


def levelled_on_ground(constants: GroundConstants, q: Quaternion) -> Quaternion:
    """Return the attitude on the ground after one step of levelling; the heading is kept."""
    w, x, y, z = q
    return normalise((w, x * constants.levelling_factor, y * constants.levelling_factor, z))
