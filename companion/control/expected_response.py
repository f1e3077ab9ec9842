"""Predicts the step response of a configuration, and finds which setting or delay limits it."""

from dataclasses import dataclass, replace
from math import asin, degrees, hypot, inf

from companion.attitude import PLANNER_NAMES
from companion.attitude.reference_model import rates_along
from companion.config import Config
from companion.control.hold_settings import attitude_delay, hold_gains, hold_weights
from companion.control.inner_loop import (
    LARGEST_GAIN_TIMES_DELAY,
    sensible_gain,
    tilt_response,
    with_gain,
)
from companion.guidance import InnerResponse

_NOTICEABLE_TIME_SHARE = 0.99
"""The removal of a cause of delay is reported if it reduces the time constant below this share of
the present time constant."""

_GAIN_KEY, _RATE_LIMIT_KEY = "planner.gain_per_s", "limits.max_tilt_rate_deg_s"
_LAG_CAUSE, _DEAD_TIME_CAUSE = "the vehicle's lag", "the vehicle's dead time"


@dataclass(frozen=True, slots=True)
class ExpectedResponse:
    """Predicted response to the largest step of the maneuver `steps`, such as from −0.3 to 0.3."""

    coefficient: float
    """`steps.coefficient`, at which the step ends."""
    time_constant: float
    """Time until 63 % of the step is covered, s."""
    time_constants_without_cause: dict[str, float]
    """For each cause of delay, by name, the time constant (s) without this cause: without the rate
    limit, the lag or the dead time. The entry for the gain is the value with twice the gain."""
    gain: float
    """Gain p of the planner, 1/s."""
    largest_gain: float | None
    """The largest sensible gain, 1/s; None if lag and dead time are not known."""
    shortest_time_constant: float | None = None
    """Time constant with `largest_gain` and without the rate limit, s; None: no `largest_gain`."""

    @property
    def main_cause(self) -> str:
        """Name of the cause of delay whose removal reduces the time constant most."""
        return min(
            self.time_constants_without_cause, key=self.time_constants_without_cause.__getitem__
        )

    @property
    def gain_is_too_high(self) -> bool:
        """Whether the gain is larger than the largest sensible gain."""
        return self.largest_gain is not None and self.gain > self.largest_gain

    def clauses(self) -> list[str]:
        """The parts of `sentence`.

        The parts give the time constant, its causes in the order of their effect, and the shortest
        possible time constant.
        """
        effects_text = ", ".join(
            f"{time:.2f} s {f'with {name} doubled' if name == _GAIN_KEY else f'without {name}'}"
            for name, time in sorted(
                self.time_constants_without_cause.items(), key=lambda item: item[1]
            )
            if time < _NOTICEABLE_TIME_SHARE * self.time_constant
        )
        tilt_deg = degrees(asin(self.coefficient))
        clauses = [
            f"a step from -{self.coefficient:g} to {self.coefficient:g} (±{tilt_deg:.0f}° of tilt) "
            f"is expected to have a time constant of {self.time_constant:.2f} s",
            f"{self.main_cause} lengthens the time constant most ({effects_text})",
        ]
        shortest_time = self.shortest_time_constant
        if shortest_time is not None:
            clauses.append(
                f"with the largest sensible gain and no rate limit: {shortest_time:.2f} s"
            )
        return clauses

    def sentence(self) -> str:
        """A message for the user: time constant, its main cause, and the effect of each cause."""
        return "; ".join(self.clauses())

    def gain_sentence(self) -> str:
        """A message for the user about the largest sensible gain."""
        if self.largest_gain is None:
            return "the largest sensible gain is not known before `companion identify`"
        return _gain_sentence(self.gain, self.largest_gain)


def gain_warning(config: Config) -> str | None:
    """A warning for the user if the gain is above the largest sensible one, else None.

    A planner of another package gets no warning.
    """
    gain, largest_gain = config.planner.gain_per_s, sensible_gain(config)
    if config.planner_name not in PLANNER_NAMES or gain <= largest_gain:
        return None
    return _gain_sentence(gain, largest_gain)


def _gain_sentence(gain: float, largest_gain: float) -> str:
    remedy = "; lower it, because a larger gain makes the response overshoot and the hold swing"
    return (
        f"planner.gain_per_s is {gain:g}, and {largest_gain:.1f} is the largest sensible one "
        f"({LARGEST_GAIN_TIMES_DELAY} / (lag + dead time)){remedy if gain > largest_gain else ''}"
    )


def expected_response(config: Config) -> ExpectedResponse:
    """Predict the response by a linear model of planner and rate loop with the tilt rate limit."""
    step_size, response = 2.0 * config.steps.coefficient, tilt_response(config)
    max_rate = _largest_coefficient_rate(config)
    gain, largest_gain = config.planner.gain_per_s, sensible_gain(config)
    time_constants_without_cause = {
        _GAIN_KEY: tilt_response(with_gain(config, 2.0 * gain)).step_time(step_size, max_rate),
        _RATE_LIMIT_KEY: response.step_time(step_size),
        **_without_rate_loop_delays(config, response, max_rate),
    }
    return ExpectedResponse(
        config.steps.coefficient,
        response.step_time(step_size, max_rate),
        time_constants_without_cause,
        gain,
        None if largest_gain == inf else largest_gain,
        None
        if largest_gain == inf
        else tilt_response(with_gain(config, largest_gain)).step_time(step_size),
    )


def _without_rate_loop_delays(
    config: Config, response: InnerResponse, max_rate: float
) -> dict[str, float]:
    """Time constants (s) without the rate loop's lag, and without its dead time; empty: unknown."""
    if not config.vehicle.response_known:
        return {}
    step_size = 2.0 * config.steps.coefficient
    updates = {"lag_ms": 0.0, "pitch_lag_ms": None, "damping": None, "pitch_damping": None}
    without_lag = config.model_copy(update={"vehicle": config.vehicle.model_copy(update=updates)})
    return {
        _LAG_CAUSE: tilt_response(without_lag).step_time(step_size, max_rate),
        _DEAD_TIME_CAUSE: replace(response, dead_time=0.0).step_time(step_size, max_rate),
    }


def _largest_coefficient_rate(config: Config) -> float:
    """Rate of change of a coefficient while the vehicle tilts at the tilt rate limit, 1/s.

    The rate is computed where the coefficient is half of `steps.coefficient`.
    """
    roll, pitch, _ = rates_along(0.5 * config.steps.coefficient, 0.0, 1.0, 0.0)
    return config.limits.max_tilt_rate / hypot(roll, pitch)


def expectations(config: Config) -> list[str]:
    """Messages for the user: expected response, largest sensible gain, position-hold gains.

    The message about the response has a line for each clause, because it is long.
    For a planner of another package, only the message about the position hold.
    """
    if config.planner_name not in PLANNER_NAMES:
        return [hold_sentence(config)]
    response = expected_response(config)
    response_text = "\n  ".join(response.clauses())
    return [response_text, response.gain_sentence(), hold_sentence(config)]


def hold_sentence(config: Config) -> str:
    """A message for the user: gains and weights of the position hold, and the attitude's delay."""
    gains, weights, delay = hold_gains(config), hold_weights(config), attitude_delay(config)
    return (
        f"the hold has gains of {gains.position:.1f} 1/s² on position, {gains.velocity:.1f} 1/s on "
        f"velocity and {gains.acceleration:.2f} on acceleration; they follow from the weights "
        f"{weights.position:.4g} 1/s⁴ and {weights.velocity:.3g} 1/s² and the attitude's delay, "
        f"{delay:.2f} s"
    )
