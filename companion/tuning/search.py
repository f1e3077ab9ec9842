"""Searches gain, weights and bandwidth for the smallest expected error within the margins."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import exp, inf, log
from typing import NamedTuple

from companion.config import Config
from companion.control.hold_settings import attitude_delay, slewing_delay
from companion.control.inner_loop import sensible_gain, with_gain
from companion.tuning.expectation import Disturbances, expected_errors, loop_margins
from companion.tuning.loop import EXACT, ModelMismatch, control_loops
from companion.tuning.margins import Margins, frequencies, margins

_FIRST_STEP, _LAST_STEP = 0.4, 0.08
"""First and last step size of the search: change of the natural logarithm of a value."""
_COST_OF_MISSED_AIM = 30.0
"""Cost per unit of `_shortfall`; it is added to the natural logarithm of the expected error."""


@dataclass(frozen=True, slots=True)
class Aims:
    """Requirements of a proposal; the search adds a penalty for each missed requirement."""

    gain_db: float = 7.0
    """Smallest gain margin, dB."""
    phase_deg: float = 31.0
    """Smallest phase margin, degrees."""
    mismatch_factor: float = 1.3
    """Factor by which real lag and dead time may be larger or smaller than configured."""
    mismatch_gain_db: float = 3.0
    """Smallest gain margin when lag and dead time differ by `mismatch_factor`, dB. While the rate
    loop is at its slew limit, half of both `mismatch_` margins is enough."""
    mismatch_phase_deg: float = 15.0
    """Smallest phase margin when lag and dead time differ by `mismatch_factor`, degrees."""
    rate_fraction: float = 1.0
    """Largest ratio of three standard deviations of the commanded roll-pitch rate to the limit of
    this rate."""


class Design(NamedTuple):
    """Values of the configuration that the search chooses."""

    gain: float
    """Gain p of the planner, 1/s."""
    position_weight: float
    """Weight of the position in guidance, 1/s⁴."""
    velocity_weight: float
    """Weight of the velocity in guidance, 1/s²."""
    bandwidth: float
    """Bandwidth of the motion observer, rad/s."""

    def apply_to(self, config: Config) -> Config:
        """Return `config` with these values."""
        weights = {
            "position_weight_per_s4": self.position_weight,
            "velocity_weight_per_s2": self.velocity_weight,
            "disturbance_bandwidth_rad_s": self.bandwidth,
        }
        guidance = config.guidance.model_copy(update=weights)
        return with_gain(config, self.gain).model_copy(update={"guidance": guidance})

    def rounded(self) -> "Design":
        """The values rounded to three digits, as in the file of the proposal."""
        return Design(*(float(f"{value:.3g}") for value in self))


_LOWER_BOUNDS = Design(1.0, 0.01, 0.01, 0.3)
_UPPER_BOUNDS = Design(20.0, 10000.0, 10000.0, 14.0)
_MAX_BANDWIDTH_WITH_SLEW_LIMIT = 8.0
"""Largest bandwidth for a rate loop with a slew limit (ArduPilot), rad/s.

Position and velocity of ArduPilot's estimator do not quite agree, and the analysis neglects this.
On the mock vehicle, 14 rad/s gave errors an eighth larger in still air and a fifth larger in gusts.
"""
_SLEWING_MARGIN_FRACTION = 0.5
"""Share of the `mismatch` margins that must remain while the rate loop is at its slew limit.

Without any margin left, a figure-eight in gusts could oscillate by more than 1 m on the mock
vehicle.
"""


def largest_gain(config: Config) -> float:
    """Largest planner gain of the search, 1/s: `inner_loop.sensible_gain`, but at most 20."""
    return min(_UPPER_BOUNDS.gain, sensible_gain(config))


def upper_bounds(config: Config) -> Design:
    """Upper bounds of the search for this vehicle."""
    design = _UPPER_BOUNDS._replace(gain=largest_gain(config))
    if config.vehicle.axes["roll"].acceleration_limit is None:
        return design
    return design._replace(bandwidth=_MAX_BANDWIDTH_WITH_SLEW_LIMIT)


def search(config: Config, disturbances: Disturbances, aims: Aims) -> Design:
    """The design with the smallest `_cost`, found by a pattern search.

    Args:
        config: a configuration with an identified vehicle.
        disturbances: disturbances of the vehicle.
        aims: requirements of the proposal.

    Raises:
        ConfigError: see `control_loops`.
    """
    best_designs = [
        _best_near(config, start, disturbances, aims) for start in _starting_designs(config)
    ]
    return min(best_designs)[1].rounded()


def _best_near(
    config: Config, start: Design, disturbances: Disturbances, aims: Aims
) -> tuple[float, Design]:
    """The best design that the search finds from `start`, with its cost."""
    upper = upper_bounds(config)
    best, step = Design(*map(min, start, upper)), _FIRST_STEP
    cost = _cost(config, best, disturbances, aims)
    while step >= _LAST_STEP:
        for design in _neighbour_designs(best, step, upper):
            neighbour_cost = _cost(config, design, disturbances, aims, cost)
            if neighbour_cost < cost:
                best, cost = design, neighbour_cost
                break
        else:
            step *= 0.5
    return cost, best


def _starting_designs(config: Config) -> Iterator[Design]:
    """Three starting designs, because the pattern search finds only the nearest minimum.

    The values scale with the delay of the attitude, as the default weights do
    (`hold_settings.hold_weights`). The velocity weights are lower and the observers quicker than
    the defaults.
    """
    for gain_fraction, position, velocity, bandwidth in (
        (1.0, 1.0, 0.5, 2.0),
        (1.0, 0.9, 0.1, 2.7),
        (0.8, 1.4, 0.12, 3.5),
    ):
        gain = gain_fraction * largest_gain(config)
        delay = attitude_delay(with_gain(config, gain))
        yield Design(gain, position / delay**4, velocity / delay**2, bandwidth / delay)


def _neighbour_designs(design: Design, step: float, upper: Design) -> Iterator[Design]:
    """Designs that differ by one step in one or two values, clamped to the bounds."""
    up, down = exp(step), exp(-step)
    scale_factors = [
        *((1.0,) * k + (ratio,) + (1.0,) * (3 - k) for k in range(4) for ratio in (up, down)),
        (1.0, up, 1.0, down), (1.0, down, 1.0, up), (up, down, 1.0, 1.0), (down, up, 1.0, 1.0),
        (up, 1.0, 1.0, down), (down, 1.0, 1.0, up),
    ]  # fmt: skip
    for factors in scale_factors:
        neighbour = Design(*(value * factor for value, factor in zip(design, factors, strict=True)))
        yield Design(*map(max, _LOWER_BOUNDS, map(min, upper, neighbour)))


def _cost(
    config: Config, design: Design, disturbances: Disturbances, aims: Aims, stop_at: float = inf
) -> float:
    """Logarithm of the expected position error, plus a penalty for each missed requirement.

    The computation stops when the cost reaches `stop_at`; the result is then a lower bound.
    """
    candidate = design.apply_to(config)
    s = frequencies()
    loop_for = control_loops(candidate, s)
    loop = loop_for(EXACT)
    expected_error = expected_errors(loop, disturbances, 1.0 / config.link.position_rate_hz)
    shortfall = _shortfall(loop_margins(loop), aims.gain_db, aims.phase_deg)
    max_rate = aims.rate_fraction * config.limits.max_tilt_rate
    shortfall += max(0.0, 3.0 * expected_error.commanded_rate / max_rate - 1.0)
    cost = log(expected_error.position) + _COST_OF_MISSED_AIM * shortfall
    for mismatch in tolerated_mismatches(candidate, aims):
        if cost >= stop_at:
            break
        loop = loop_for(mismatch)
        factor = _SLEWING_MARGIN_FRACTION if mismatch.delay else 1.0
        required_margins = factor * aims.mismatch_gain_db, factor * aims.mismatch_phase_deg
        cost += _COST_OF_MISSED_AIM * _shortfall(margins(s, loop.gain_at_rate), *required_margins)
    return cost


def tolerated_mismatches(config: Config, aims: Aims) -> list[ModelMismatch]:
    """Model errors with which a margin must remain: wrong lag and dead time, delay by slewing."""
    factor = aims.mismatch_factor
    mismatches = [ModelMismatch(time_factor=each) for each in (factor, 1.0 / factor)]
    delay = slewing_delay(config)
    return [*mismatches, ModelMismatch(delay=delay)] if delay > 0.0 else mismatches


def _shortfall(actual: Margins, gain_db: float, phase_deg: float) -> float:
    """Sum of the shortfalls of gain margin (in units of 6 dB) and phase margin (in units of 30°).

    For an unstable loop: 1 plus the distances of gain and phase from stability, in these units.
    """
    if not actual.stable:
        return 1.0 + actual.gain_db / 6.0 + actual.phase_deg / 30.0
    gain_shortfall = max(0.0, gain_db - actual.gain_db) / 6.0
    return gain_shortfall + max(0.0, phase_deg - actual.phase_deg) / 30.0
