"""Expected behaviour of a configuration: margins, tracking error, rates and settling time."""

from dataclasses import dataclass
from math import hypot, pi, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from companion.config import Config
from companion.tuning.feedback import Complex
from companion.tuning.loop import EXACT, Loop, ModelMismatch, control_loop
from companion.tuning.margins import Margins, frequencies, margins, smaller_margins

Floats = NDArray[np.float64]

_SETTLED_FRACTION = 0.05
"""Share of its peak below which the response to a gust has settled."""
_RESPONSE_DURATION = 10.0
"""Duration of the computed response to a gust, s."""
_RESPONSE_TIME_STEP = 0.01
"""Time between computed points of the response to a gust, s."""


@dataclass(frozen=True, slots=True)
class Disturbances:
    """Disturbances of the vehicle on each horizontal axis."""

    gust: float = 0.5
    """Standard deviation of the gusts, m/s; drag turns them into an acceleration."""
    gust_correlation_time: float = 2.0
    """Correlation time of the gusts, s."""
    velocity_error: float = 0.03
    """Standard deviation of the slow error of the estimated velocity on a flown path, m/s."""
    acceleration_error: float = 0.1
    """Standard deviation of the slow error of the predicted acceleration on a flown path, m/s²."""
    path_correlation_time: float = 1.0
    """Correlation time of the errors on a path, `velocity_error` and `acceleration_error`, s."""
    velocity_density: float = 0.01
    """One-sided amplitude spectral density of the estimated velocity's error in hover, m/s/√Hz."""
    acceleration_density: float = 0.02
    """One-sided amplitude spectral density of the acceleration that is not due to tilt and drag,
    m/s²/√Hz."""
    position_noise: float = 0.003
    """Standard deviation of the noise of a single position estimate, m."""
    velocity_noise: float = 0.005
    """Standard deviation of the noise of a single velocity estimate, m/s."""
    source: str = "typical of a multirotor"
    """Text for the user: source of the values of densities and noise."""


class Errors(NamedTuple):
    """Expected standard deviations of the horizontal position error and of the commanded rate."""

    gusts: float
    """Position error due to gusts, m."""
    path: float
    """Position error on a path at 5 m/s, m."""
    noise: float
    """Position error due to the noise of the estimate, m."""
    commanded_rate: float
    """Commanded roll-pitch rate √(p² + q²) due to gusts, path and noise, rad/s."""

    @property
    def position(self) -> float:
        """Position error due to gusts, path and noise, m."""
        return hypot(self.gusts, self.path, self.noise)


@dataclass(frozen=True, slots=True)
class Expectation:
    """The expected behaviour of a configuration."""

    margins_at_rate: Margins
    """Margins of the loop opened at the commanded body rate."""
    margins_at_acceleration: Margins
    """Margins of the loop opened at the commanded acceleration."""
    errors: Errors
    """Expected position errors and commanded rate."""
    peak_error: float
    """Largest position error after a gust that at once adds 1 m/s to the vehicle's velocity, m."""
    settling_time: float
    """Time from the gust of `peak_error` until the position error stays below 5 % of `peak_error`,
    s; at most 10."""

    @property
    def margins(self) -> Margins:
        """The smaller value of each margin in `margins_at_rate` and `margins_at_acceleration`."""
        return smaller_margins(self.margins_at_rate, self.margins_at_acceleration)


def stability(config: Config, mismatch: ModelMismatch = EXACT) -> Margins:
    """Stability margins of a configuration.

    The loop is opened at the commanded body rate and at the commanded acceleration; of each margin
    the smaller value is returned.

    Args:
        config: the configuration.
        mismatch: difference between the real rate loop and the configured one.

    Raises:
        ConfigError: see `control_loop`.
    """
    return loop_margins(control_loop(config, frequencies(), mismatch))


def loop_margins(loop: Loop) -> Margins:
    """Stability margins of a loop at `frequencies`; see `stability`."""
    return smaller_margins(
        margins(loop.s, loop.gain_at_rate), margins(loop.s, loop.gain_at_acceleration)
    )


def expected_errors(loop: Loop, disturbances: Disturbances, period: float) -> Errors:
    """The expected errors of a control loop.

    Args:
        loop: loop at `frequencies`.
        disturbances: disturbances of the vehicle.
        period: time between two position messages, s.
    """
    omega = loop.s.imag
    acceleration_responses = loop.responses_to_acceleration()
    velocity_responses = loop.responses_to_error(loop.velocity_feedback)
    position_responses = loop.responses_to_error(loop.position_feedback)
    gust_time, path_time = disturbances.gust_correlation_time, disturbances.path_correlation_time
    gust_density = _slow_density(omega, disturbances.gust * loop.drag, gust_time)
    gusts = ((acceleration_responses, gust_density),)
    path = (
        (velocity_responses, _slow_density(omega, disturbances.velocity_error, path_time)),
        (acceleration_responses, _slow_density(omega, disturbances.acceleration_error, path_time)),
    )
    velocity_density = disturbances.velocity_density**2
    velocity_density += 2.0 * period * disturbances.velocity_noise**2
    noise = (
        (velocity_responses, velocity_density),
        (acceleration_responses, disturbances.acceleration_density**2),
        (position_responses, 2.0 * period * disturbances.position_noise**2),
    )
    causes = (gusts, path, noise)
    # Both axes are disturbed independently, therefore the factor 2.
    gust_error, path_error, noise_error = (
        sqrt(sum(2.0 * _variance(omega, response[0], density) for response, density in terms))
        for terms in causes
    )
    rate_variance = sum(
        2.0 * _variance(omega, response[1], density)
        for terms in causes
        for response, density in terms
    )
    return Errors(gust_error, path_error, noise_error, sqrt(rate_variance))


def _slow_density(omega: Floats, sigma: float, correlation_time: float) -> Floats:
    """(n,), one-sided power spectral density, per Hz, of noise after a first-order low-pass filter.

    Args:
        omega: (n,), frequencies, rad/s.
        sigma: standard deviation of the noise.
        correlation_time: correlation time of the noise, s.
    """
    return 4.0 * sigma**2 * correlation_time / (1.0 + (omega * correlation_time) ** 2)


def expectation(config: Config, disturbances: Disturbances) -> Expectation:
    """The expected behaviour of a configuration.

    Raises:
        ConfigError: see `control_loop`.
    """
    s = frequencies()
    loop = control_loop(config, s)
    peak_error, settling_time = _gust_response(config)
    return Expectation(
        margins(s, loop.gain_at_rate),
        margins(s, loop.gain_at_acceleration),
        expected_errors(loop, disturbances, 1.0 / config.link.position_rate_hz),
        peak_error,
        settling_time,
    )


def _variance(omega: Floats, response: Complex, density: Floats | float) -> float:
    """Variance of the response to noise with a one-sided power spectral density, per Hz.

    Args:
        omega: (n,), frequencies, rad/s.
        response: (n,), frequency response to the noise.
        density: power spectral density, (n,), or a number for white noise.
    """
    return float(np.trapezoid(np.abs(response) ** 2 * density, omega) / (2.0 * pi))


def _gust_response(config: Config) -> tuple[float, float]:
    """`Expectation.peak_error` and `Expectation.settling_time` of a configuration."""
    real_part = 0.1  # 1/s; the integrators lie to the left of the frequencies
    omega = np.arange(0.0, 60.0, 0.05)
    s = np.asarray(real_part + 1j * omega, dtype=np.complex128)
    position, _ = control_loop(config, s).responses_to_acceleration()
    time = np.arange(0.0, _RESPONSE_DURATION, _RESPONSE_TIME_STEP)
    integral = np.trapezoid(np.exp(1j * np.outer(time, omega)) * position, omega).real
    response = np.abs(np.exp(real_part * time) * integral / pi)
    peak_error = float(response.max())
    unsettled = np.flatnonzero(response > _SETTLED_FRACTION * peak_error)
    return peak_error, float(time[unsettled[-1]]) + _RESPONSE_TIME_STEP
