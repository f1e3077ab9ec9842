"""The autopilot's estimate: the true motion with delay, noise, filter error, estimator resets."""

from collections.abc import Callable, Sequence
from math import cos, log, pi, radians, sin, sqrt
from random import Random
from typing import NamedTuple

from sitl_mock.config.sensors import SensorConfig
from sitl_mock.physics.height_error import HeightError
from sitl_mock.physics.navigation_error import (
    ErrorConstants,
    ErrorState,
    ErrorVectors,
    FilterState,
    TruthHistory,
    TruthRow,
    error_at,
)
from sitl_mock.physics.navigation_filter import NavigationFilter
from sitl_mock.physics.quaternion import (
    Quaternion,
    Vector,
    from_yaw,
    multiply,
    normalise,
    rotated_slightly,
    to_body,
)

NO_ERRORS = ErrorVectors((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
_NO_ERROR_STATE = ErrorState((0j, 0j, 0j), (0j, 0j), (0j, 0j))
_NO_FILTER = FilterState(
    _NO_ERROR_STATE,
    _NO_ERROR_STATE,
    0.0,
    0.0,
    0.0,
    HeightError(0.0, 0.0, 0.0, 0.0, 0.0),
    0.0,
    0.0,
    0j,
    0j,
)
_ESTIMATES_PER_DRAW = 16
"""Number of estimates for which noise is drawn at a time; even, as normal numbers come in pairs."""


class Estimate(NamedTuple):
    """The autopilot's estimate. SI; world NED (origin: position at boot), body FRD."""

    q: Quaternion
    body_rates: Vector  # rad/s, what the gyro measures
    position_ned: Vector  # m
    velocity_ned: Vector  # m/s
    specific_force_frd: Vector  # m/s^2, what an accelerometer measures


class SensorConstants(NamedTuple):
    """Constants of the simulated estimator: its delays and errors, without the white noise."""

    gravity: float  # m/s^2
    attitude_delay: int  # steps
    rate_delay: int  # steps
    position_delay: int  # steps
    dt: float  # length of a step, s
    has_filter: bool  # whether there is a navigation filter, with the constants `filter_constants`
    filter_constants: ErrorConstants
    yaw_rate_bias: float  # rad/s


class SensorState(NamedTuple):
    """The part of the estimator's state that only fixes and resets change."""

    filter: FilterState
    reset_rotation: Quaternion  # rotation of the estimate by all resets
    reset_offset: Vector  # shift of the estimate by all resets, NED, m


def white_noise(numbers: list[float], deviations: tuple[float, ...]) -> None:
    """Turn uniform random numbers into normal ones, in place, by Box-Muller as in `Random.gauss`.

    Args:
        numbers: an even number of random numbers, 0 <= x < 1; they are replaced.
        deviations: standard deviations of the normal numbers, which are used in turn.
    """
    period = len(deviations)
    for index in range(0, len(numbers), 2):
        angle = numbers[index] * 2.0 * pi
        radius = sqrt(-2.0 * log(1.0 - numbers[index + 1]))
        numbers[index] = 0.0 + cos(angle) * radius * deviations[index % period]
        numbers[index + 1] = 0.0 + sin(angle) * radius * deviations[(index + 1) % period]


def estimate(
    constants: SensorConstants,
    state: SensorState,
    history: TruthHistory,
    steps: int,
    time: float,
    noise: Sequence[float],
) -> tuple[Estimate, Vector]:
    """Return the present estimate, and the filter's attitude error in it, rad, NED (pure).

    `history` is the true motion of the latest steps, `time` the present time, s. `noise` has three
    numbers each for attitude, rates, position, velocity and force.
    """
    attitude_row = history[(steps - constants.attitude_delay) % len(history)]
    position_row = history[(steps - constants.position_delay) % len(history)]
    if constants.has_filter:
        error = error_at(
            constants.filter_constants,
            state.filter,
            position_row,
            time - constants.position_delay * constants.dt,
        )
    else:
        error = NO_ERRORS
    q = (attitude_row[3], attitude_row[4], attitude_row[5], attitude_row[6])
    fx, fy, fz = to_body(
        q, (attitude_row[13], attitude_row[14], attitude_row[15] - constants.gravity)
    )
    attitude_estimate = multiply(state.reset_rotation, rotated_slightly(error.attitude, q))
    rate_row = history[(steps - constants.rate_delay) % len(history)]
    yaw_rate = rate_row[9] + constants.yaw_rate_bias + noise[5]
    position, velocity, offset = error.position, error.velocity, state.reset_offset
    new_estimate = Estimate(
        normalise(multiply(attitude_estimate, (1.0, noise[0], noise[1], noise[2]))),
        (rate_row[7] + noise[3], rate_row[8] + noise[4], yaw_rate),
        (
            position_row[10] + position[0] + offset[0] + noise[6],
            position_row[11] + position[1] + offset[1] + noise[7],
            position_row[12] + position[2] + offset[2] + noise[8],
        ),
        (
            position_row[0] + velocity[0] + noise[9],
            position_row[1] + velocity[1] + noise[10],
            position_row[2] + velocity[2] + noise[11],
        ),
        (fx + noise[12], fy + noise[13], fz + noise[14]),
    )
    return new_estimate, error.attitude


class Estimator:
    """The state of the simulated estimator, and the seeded generator of its white noise.

    Only `draw_noise` uses the generator, so the white noise depends on the seed and the number of
    calls. The noise of the navigation filter depends on the seed and the time.

    Args:
        start: the true motion at time 0.
        gravity: acceleration of gravity, m/s^2.
        dt: length of a step, s.
        make_noise: like `white_noise`, but it may return the numbers in another container.

    Attributes:
        constants: constants of `estimate`.
        state: errors after the latest fix, and all resets.
        attitude_error: small rotation from the true to the estimated attitude at the latest
            estimate, rad, NED.
        reset_counter: estimator resets since boot.
        history_length: steps whose motion an estimate needs, the present one included.
    """

    def __init__(
        self,
        config: SensorConfig,
        start: TruthRow,
        *,
        gravity: float,
        dt: float,
        seed: int,
        make_noise: Callable[[list[float], tuple[float, ...]], Sequence[float]],
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
        filter_ = None if config.ekf is None else NavigationFilter(config.ekf, start, seed)
        self.constants = SensorConstants(
            gravity,
            round(config.attitude_delay_ms * 1e-3 / dt),
            round((config.attitude_delay_ms + config.rate_lag_ms) * 1e-3 / dt),
            round(config.position_delay_ms * 1e-3 / dt),
            dt,
            filter_ is not None,
            ErrorConstants(0.0, 0.0, 0j, 0.0, 0.0, 0.0) if filter_ is None else filter_.constants,
            0.0 if config.ekf is None else radians(config.ekf.yaw_rate_bias_deg_s),
        )
        fix_delay = 0 if config.ekf is None else round(config.ekf.fix_delay_ms * 1e-3 / dt)
        self._fusion_delay = max(fix_delay, self.constants.position_delay)
        self.history_length = 1 + max(self.constants.rate_delay, self._fusion_delay)
        self._filter = filter_
        filter_state = _NO_FILTER if filter_ is None else filter_.state
        self.state = SensorState(filter_state, (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        self._random = Random(f"{seed}/sensors")
        self._make_noise = make_noise
        self._noise: Sequence[float] = ()
        self._noise_used_count = 0
        self.attitude_error: Vector = (0.0, 0.0, 0.0)
        self.reset_counter = 0

    def shift(self, *, yaw: float = 0.0, position_ned: Vector = (0.0, 0.0, 0.0)) -> None:
        """Reset the estimator: the estimate jumps by `yaw` (rad) and `position_ned` (m)."""
        n, e, d = self.state.reset_offset
        self.state = self.state._replace(
            reset_rotation=multiply(from_yaw(yaw), self.state.reset_rotation),
            reset_offset=(n + position_ned[0], e + position_ned[1], d + position_ned[2]),
        )
        self.reset_counter += 1

    def correct(self, time: float, truth_ago: Callable[[int], TruthRow]) -> None:
        """Correct the errors if a fix of the navigation filter is due.

        Args:
            time: present time, s.
            truth_ago: returns the true motion k steps ago, for k below `history_length`.
        """
        fusion_time = time - self._fusion_delay * self.constants.dt
        if self._filter is not None and self._filter.is_due(fusion_time):
            self._filter.advance(truth_ago(self._fusion_delay), fusion_time, truth_ago(0), time)
            self.state = self.state._replace(filter=self._filter.state)

    def draw_noise(self) -> Sequence[float]:
        """Return new white noise for one estimate, 15 numbers."""
        count, begin = len(self._deviations), self._noise_used_count
        if begin == len(self._noise):
            random = self._random.random
            uniform_numbers = [random() for _ in range(count * _ESTIMATES_PER_DRAW)]
            self._noise = self._make_noise(uniform_numbers, self._deviations)
            begin = 0
        self._noise_used_count = begin + count
        return self._noise[begin : begin + count]
