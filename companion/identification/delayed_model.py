"""First- and second-order models of a rate loop, and their fit to a record with a dead time."""

from collections.abc import Callable
from dataclasses import dataclass
from math import exp, log, nan

import numpy as np

from companion.identification.lags import (
    Knots,
    first_order_response,
    held_commands,
    second_order_free_responses,
    second_order_response,
    slew_limited,
    value_at,
)
from companion.identification.record import LONGEST_DEAD_TIME, Segment
from companion.identification.residual_analysis import FitQuality
from companion.least_squares import Floats, Solution, minimise, project


class FirstOrder:
    """A first-order lag; its `log_params` are (log lag), lag in s."""

    lower_bounds, upper_bounds = np.log([0.001]), np.log([1.0])

    def response(self, log_params: Floats, commands: Knots, times: Floats) -> Floats:
        """(m,), response at `times` (m,), s, from the steady state of the first command."""
        return first_order_response(commands, exp(log_params[0]), times)

    def free_responses(self, log_params: Floats, elapsed: Floats) -> Floats:
        """(m, number of `log_params`), independent free responses at (m,) times after the start, s.

        The effect of any initial state is a weighted sum of the free responses.
        """
        return np.asarray(np.exp(-elapsed / exp(log_params[0])))[:, np.newaxis]


class SecondOrder:
    """A second-order lag; its `log_params` are (log 2ζ/ω, log ζ).

    In a fit, these two parameters are nearly independent, unlike ω and ζ. 2ζ/ω is the delay of the
    response to a ramp, s.
    """

    lower_bounds, upper_bounds = np.log([0.002, 0.2]), np.log([1.0, 4.0])

    def response(self, log_params: Floats, commands: Knots, times: Floats) -> Floats:
        """See `FirstOrder.response`."""
        return second_order_response(commands, *frequency_damping(log_params), times)

    def free_responses(self, log_params: Floats, elapsed: Floats) -> Floats:
        """See `FirstOrder.free_responses`."""
        return second_order_free_responses(elapsed, *frequency_damping(log_params))


Model = FirstOrder | SecondOrder
"""A linear response of gain 1, whose parameters are searched as logarithms, `log_params`."""


def frequency_damping(log_params: Floats) -> tuple[float, float]:
    """Natural frequency ω (rad/s) and damping ratio ζ from the `log_params` of a `SecondOrder`."""
    damping = exp(log_params[1])
    return 2.0 * damping / exp(log_params[0]), damping


@dataclass(frozen=True, slots=True)
class SecondOrderFit:
    """A second-order fit: ÿ = ω²·(gain·u(t − dead time) − y) − 2ζω·ẏ."""

    frequency: float
    """Natural frequency ω, rad/s."""
    damping: float
    """Damping ratio ζ."""
    dead_time: float
    """Dead time, s."""
    gain: float
    """Steady measured rate per commanded rate."""
    slew: float | None
    """Slew limit of the command, rad/s²; None: no limit was found."""
    fit: FitQuality

    @property
    def lag(self) -> float:
        """2ζ/ω, s: the first-order lag with the same delay of the response to a ramp."""
        return 2.0 * self.damping / self.frequency

    @property
    def described(self) -> str:
        """Text for the user: model, parameters and R² in one line."""
        return (
            f"second order, natural frequency {self.frequency:.1f} rad/s, damping ratio "
            f"{self.damping:.2f}, dead time {1e3 * self.dead_time:.0f} ms, explains "
            f"{self.fit.explained:.1%} of the variance"
        )


DEAD_TIME_RANGE = 0.0, LONGEST_DEAD_TIME - 0.01
"""Range in which the dead time is searched, s."""
_RAMP_TIME_RANGE = 0.01, 0.5
"""Bounds of the search for the slew limit: the time, s, that the largest change of the commands
takes at that limit."""
_SAME_COMMAND_FRACTION = 0.005
"""Largest difference of commands that count as the same, as a share of the commands' range."""


class DelayedModel:
    """The response of a model to the commands of a record, compared with every n-th sample.

    y(t) = gain·x(t − dead time) + offset + free response of each segment, where x is the model's
    exact response. Linear regression gives the offset, the initial states, and the gain if it is
    not given. The other unknowns are searched: the logarithms of the model's parameters, the dead
    time (s), and optionally the logarithm of the slew limit.

    Attributes:
        model: response without dead time, of first or second order.
        gain: the given gain; None: the gain is fitted.
        thinning: n; every n-th sample is used.
        commands: commands of each segment, before the slew limit.
        times: times of the samples of each segment, s.
        measured: (m,), the samples of all segments.
        largest_change: largest change of a command.
    """

    def __init__(
        self, record: list[Segment], model: Model, gain: float | None, thinning: int = 1
    ) -> None:
        self.model, self.gain, self.thinning = model, gain, thinning
        self._dead_time_index = model.lower_bounds.size
        span = max(float(np.ptp(segment.commanded)) for segment in record)
        self.commands = [
            held_commands(segment.time, segment.commanded, _SAME_COMMAND_FRACTION * span)
            for segment in record
        ]
        self.times = [segment.measured_time[::thinning] for segment in record]
        self.measured = np.concatenate([segment.measured[::thinning] for segment in record])
        changes = [np.abs(np.diff(knots.value)).max(initial=0.0) for knots in self.commands]
        self.largest_change = float(max(changes))
        self._slew_cache: tuple[float, list[Knots]] = (nan, [])

    def projection(self, unknowns: Floats) -> tuple[Floats, Floats]:
        """Best gain, offset and initial states for these unknowns, and the residual, (m,)."""
        response = self.response(unknowns)
        if self.gain is None:
            columns = np.column_stack((response, self._offset_columns(unknowns)))
            return project(columns, self.measured)
        columns = self._offset_columns(unknowns)
        weights, residual = project(columns, self.measured - self.gain * response)
        return np.concatenate(([self.gain], weights)), residual

    def response(self, unknowns: Floats) -> Floats:
        """(m,), response of the model to the delayed commands."""
        log_params = unknowns[: self._dead_time_index]
        return self._per_segment(
            unknowns, lambda knots, at: self.model.response(log_params, knots, at)
        )

    def delayed_commands(self, unknowns: Floats, extra_delay: float = 0.0) -> Floats:
        """(m,), the commands after slew limit, dead time and `extra_delay`, s."""
        return self._per_segment(
            unknowns, lambda knots, at: value_at(knots, np.maximum(at - extra_delay, knots.time[0]))
        )

    def dead_time(self, unknowns: Floats) -> float:
        """The dead time contained in the unknowns, s."""
        return float(unknowns[self._dead_time_index])

    def slew(self, unknowns: Floats) -> float | None:
        """The slew limit contained in the unknowns, per second; None if there is none."""
        return exp(unknowns[-1]) if unknowns.size > self._dead_time_index + 1 else None

    def search(self, start: Floats) -> Solution:
        """The best fit, searched from the unknowns `start`."""
        slew_limits = [
            log(self.largest_change / ramp_time) for ramp_time in reversed(_RAMP_TIME_RANGE)
        ]
        bounds = [
            *zip(self.model.lower_bounds, self.model.upper_bounds, strict=True),
            DEAD_TIME_RANGE,
            slew_limits,
        ]
        lowest, highest = np.array(bounds[: start.size]).T
        return minimise(self.projection, start, lowest, highest)

    def best_of(self, points: list[Floats]) -> Floats:
        """The point (values of the unknowns) with the smallest sum of squares of the residual."""
        residuals = [self.projection(point)[1] for point in points]
        return points[int(np.argmin([float(residual @ residual) for residual in residuals]))]

    def r_squared(self, solution: Solution) -> float:
        """R² of a solution; 0 if the measurements are constant."""
        deviation = self.measured - self.measured.mean()
        return 1.0 - solution.rss / float(deviation @ deviation) if deviation.any() else 0.0

    def _offset_columns(self, unknowns: Floats) -> Floats:
        """(m, 1 + number of initial states): ones, and free responses of each segment.

        A free response begins at the first sample of its segment. A free response from the first
        command on would be nearly 0 at the samples, and its weight would be unbounded.
        """
        log_params = unknowns[: self._dead_time_index]
        free_responses = [
            self.model.free_responses(log_params, times - times[0]) for times in self.times
        ]
        state_count = sum(free_response.shape[1] for free_response in free_responses)
        columns = np.zeros((self.measured.size, 1 + state_count))
        columns[:, 0] = 1.0
        row, column = 0, 1
        for free_response in free_responses:
            row_count, column_count = free_response.shape
            columns[row : row + row_count, column : column + column_count] = free_response
            row, column = row + row_count, column + column_count
        return columns

    def _per_segment(self, unknowns: Floats, compute: Callable[[Knots, Floats], Floats]) -> Floats:
        """(m,), results of `compute` for the slew-limited, delayed commands of each segment."""
        slew, delay = self.slew(unknowns), self.dead_time(unknowns)
        commands = self.commands if slew is None else self._slew_limited(slew)
        pairs = zip(commands, self.times, strict=True)
        return np.concatenate([compute(knots, times - delay) for knots, times in pairs])

    def _slew_limited(self, slew: float) -> list[Knots]:
        """The commands of each segment after the slew limit; the latest result is cached."""
        if slew != self._slew_cache[0]:
            self._slew_cache = slew, [slew_limited(knots, slew) for knots in self.commands]
        return self._slew_cache[1]
