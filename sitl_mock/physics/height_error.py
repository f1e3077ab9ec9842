"""The slow errors of the estimated height and vertical speed, from fix to fix."""

from math import exp
from random import Random
from typing import NamedTuple

from sitl_mock.config.sensors import EkfConfig
from sitl_mock.physics.slow_noise import next_slow_noise

_SINK_ERROR_TIME_S = 2.0
"""Time constant with which the error of the vertical speed follows the acceleration, s."""


class HeightError(NamedTuple):
    """Slow errors after a fix, estimate minus truth, positive down."""

    down: float  # error of the position, m
    down_rate: float  # change of `down` until the next fix, m/s
    sink_by_acceleration: float  # error of the speed that the position does not integrate, m/s
    sink_noise: float  # error of the speed that the position integrates, m/s
    measurement_noise: float  # error of the measured height, m


class HeightErrorModel:
    """Computes the slow errors of height and vertical speed.

    The position integrates the noise of the speed, and follows the measured height, which has its
    own slow noise. A horizontal acceleration adds an error to each.
    """

    def __init__(self, config: EkfConfig, seed: int) -> None:
        self._config = config
        self._random = Random(f"{seed}/height")

    def initial(self) -> HeightError:
        """Return the errors of a vehicle that has been standing for long."""
        measurement_noise = self._random.gauss(0.0, self._config.height_noise_m)
        sink_noise = self._random.gauss(0.0, self._config.sink_noise_m_s)
        return HeightError(measurement_noise, sink_noise, 0.0, sink_noise, measurement_noise)

    def next(self, error: HeightError, acceleration: float, elapsed: float) -> HeightError:
        """Return the errors at the next fix.

        Args:
            error: errors after the latest fix.
            acceleration: horizontal acceleration, m/s^2.
            elapsed: time since the latest fix, s.
        """
        config = self._config
        down = error.down + error.down_rate * elapsed
        sink_noise = self._next_noise(
            error.sink_noise, config.sink_noise_m_s, config.sink_noise_time_s, elapsed
        )
        measurement_noise = self._next_noise(
            error.measurement_noise, config.height_noise_m, config.height_noise_time_s, elapsed
        )
        measured = config.height_sag_s4_per_m * acceleration**2 + measurement_noise
        steady_sink = config.sink_per_acceleration_ms * 1e-3 * acceleration
        change = steady_sink - error.sink_by_acceleration
        return HeightError(
            down,
            sink_noise + (measured - down) / config.height_time_s,
            error.sink_by_acceleration + (1.0 - exp(-elapsed / _SINK_ERROR_TIME_S)) * change,
            sink_noise,
            measurement_noise,
        )

    def _next_noise(self, noise: float, sigma: float, time: float, elapsed: float) -> float:
        return next_slow_noise(self._random, noise, sigma, exp(-elapsed / time))
