"""The two models of a rate loop, and their fit to a record with a dead time."""

from collections.abc import Callable
from dataclasses import dataclass
from math import exp, log, nan
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from companion.identification.lags import (
    Knots,
    held_commands,
    lagged,
    second_order,
    second_order_decay,
    slewed,
    value_at,
)
from companion.identification.record import LONGEST_DEAD_TIME, Stretch
from companion.least_squares import Solution, minimise, project

Floats = NDArray[np.float64]


class Model(Protocol):
    """A linear response of gain 1; its shape is the logarithms of its k parameters.

    Attributes:
        lowest: (k,), lower bounds of the shape.
        highest: (k,), upper bounds of the shape.
    """

    lowest: Floats
    highest: Floats

    def response(self, shape: Floats, commands: Knots, at: Floats) -> Floats:
        """(m,), response at the times `at` (m,), s, from the steady state of the first command."""
        ...

    def free_responses(self, shape: Floats, since: Floats) -> Floats:
        """(m, k), k independent free responses, `since` (m,) seconds after the start.

        Their weighted sum is the effect of any initial state.
        """
        ...


class FirstOrder:
    """A first-order lag; its shape is (log lag), lag in s."""

    lowest, highest = np.log([0.001]), np.log([1.0])

    def response(self, shape: Floats, commands: Knots, at: Floats) -> Floats:
        """The response of this lag; see `Model.response`."""
        return lagged(commands, exp(shape[0]), at)

    def free_responses(self, shape: Floats, since: Floats) -> Floats:
        """The free responses of this lag; see `Model.free_responses`."""
        return np.asarray(np.exp(-since / exp(shape[0])))[:, np.newaxis]


class SecondOrder:
    """A second-order lag; its shape is (log 2ζ/ω, log ζ).

    These two are nearly independent in a fit, unlike ω and ζ. 2ζ/ω is the delay on a ramp, s.
    """

    lowest, highest = np.log([0.002, 0.2]), np.log([1.0, 4.0])

    def response(self, shape: Floats, commands: Knots, at: Floats) -> Floats:
        """The response of this lag; see `Model.response`."""
        return second_order(commands, *frequency_damping(shape), at)

    def free_responses(self, shape: Floats, since: Floats) -> Floats:
        """The free responses of this lag; see `Model.free_responses`."""
        return second_order_decay(since, *frequency_damping(shape))


def frequency_damping(shape: Floats) -> tuple[float, float]:
    """ω (rad/s) and ζ of a `SecondOrder` with this shape."""
    damping = exp(shape[1])
    return 2.0 * damping / exp(shape[0]), damping


@dataclass(frozen=True, slots=True)
class SecondOrderFit:
    """A second-order fit: ÿ = ω²·(gain·u(t − dead time) − y) − 2ζω·ẏ.

    Attributes:
        frequency: ω, rad/s.
        damping: ζ.
        dead_time: s.
        gain: measured per commanded rate.
        slew: slew limit of the command, per second; None: no sign of a limit.
        explained: R².
        misfit: root mean square of the part of the residual that the commands explain, as a share
            of the measurements' standard deviation.
        dead_time_error: standard error of the dead time by noise, s.
        lag_error: standard error of the lag by noise, s.
    """

    frequency: float
    damping: float
    dead_time: float
    gain: float
    slew: float | None
    explained: float
    misfit: float
    dead_time_error: float
    lag_error: float

    @property
    def lag(self) -> float:
        """2ζ/ω, s: the first-order lag that has the same delay on a ramp."""
        return 2.0 * self.damping / self.frequency

    @property
    def described(self) -> str:
        """The fit in one line."""
        return (
            f"second order, natural frequency {self.frequency:.1f} rad/s, damping ratio "
            f"{self.damping:.2f}, dead time {1e3 * self.dead_time:.0f} ms, explains "
            f"{self.explained:.1%}"
        )


DEAD_TIME_RANGE = 0.0, LONGEST_DEAD_TIME - 0.01
"""Range in which the dead time is searched, s."""
_RAMP_TIMES = 0.01, 0.5
"""Shortest and longest ramp of the search for the slew limit, s: how long the largest change of the
commands takes at that limit."""
_SAME_COMMAND_SHARE = 0.005
"""Commands that differ by less than this share of their range count as the same."""


class DelayedModel:
    """A record with every n-th sample, and the response of a model to its commands.

    y(t) = gain·x(t − dead time) + offset + remainder of the initial state of each stretch, where x
    is the model's exact response. Offset, initial states and a gain that is not given are linear;
    they are eliminated. The unknowns are the model's shape, the dead time (s), and optionally the
    logarithm of the slew limit.

    Attributes:
        model: the model.
        gain: the given gain; None: it is fitted.
        thinning: n; every n-th sample is used.
        commands: commands of each stretch, without slew limit.
        times: times of the samples of each stretch, s.
        measured: (m,), the samples of all stretches.
        largest_change: largest change of a command.
    """

    def __init__(
        self, record: list[Stretch], model: Model, gain: float | None, thinning: int = 1
    ) -> None:
        self.model, self.gain, self.thinning = model, gain, thinning
        self._dead_time_index = model.lowest.size
        span = max(float(np.ptp(stretch.commanded)) for stretch in record)
        self.commands = [
            held_commands(stretch.time, stretch.commanded, _SAME_COMMAND_SHARE * span)
            for stretch in record
        ]
        self.times = [stretch.measured_time[::thinning] for stretch in record]
        self.measured = np.concatenate([stretch.measured[::thinning] for stretch in record])
        changes = [np.abs(np.diff(knots.value)).max(initial=0.0) for knots in self.commands]
        self.largest_change = float(max(changes))
        self._slew_cache: tuple[float, list[Knots]] = (nan, [])

    def projection(self, unknown: Floats) -> tuple[Floats, Floats]:
        """The best weights (gain, offset, initial states), and their residual, (m,)."""
        response = self.response(unknown)
        if self.gain is None:
            columns = np.column_stack((response, self._offset_columns(unknown)))
            return project(columns, self.measured)
        columns = self._offset_columns(unknown)
        weights, residual = project(columns, self.measured - self.gain * response)
        return np.concatenate(([self.gain], weights)), residual

    def response(self, unknown: Floats) -> Floats:
        """(m,), response of the model to the delayed commands."""
        shape = unknown[: self._dead_time_index]
        return self._per_stretch(unknown, lambda knots, at: self.model.response(shape, knots, at))

    def delayed_commands(self, unknown: Floats, later: float = 0.0) -> Floats:
        """(m,), the commands after slew limit and dead time, delayed by another `later` s."""
        return self._per_stretch(
            unknown, lambda knots, at: value_at(knots, np.maximum(at - later, knots.time[0]))
        )

    def dead_time(self, unknown: Floats) -> float:
        """Dead time among these unknowns, s."""
        return float(unknown[self._dead_time_index])

    def slew(self, unknown: Floats) -> float | None:
        """Slew limit among these unknowns, per second; None if they have none."""
        return exp(unknown[-1]) if unknown.size > self._dead_time_index + 1 else None

    def search(self, start: Floats) -> Solution:
        """The best fit near `start`."""
        ramps = [log(self.largest_change / ramp) for ramp in reversed(_RAMP_TIMES)]
        limits = [*zip(self.model.lowest, self.model.highest, strict=True), DEAD_TIME_RANGE, ramps]
        lowest, highest = np.array(limits[: start.size]).T
        return minimise(self.projection, start, lowest, highest)

    def best_of(self, points: list[Floats]) -> Floats:
        """The point with the smallest sum of squares."""
        residuals = [self.projection(point)[1] for point in points]
        return points[int(np.argmin([float(residual @ residual) for residual in residuals]))]

    def explained(self, found: Solution) -> float:
        """R² of a fit; 0 if the measurements are constant."""
        spread = self.measured - self.measured.mean()
        return 1.0 - found.squares / float(spread @ spread) if spread.any() else 0.0

    def _offset_columns(self, unknown: Floats) -> Floats:
        """(m, 1 + initial states): ones, and the remainder of the initial state of each stretch.

        The initial state is taken at the first sample of the stretch. A state at the first command
        would have decayed to nearly nothing there, and its weight would be unbounded.
        """
        shape = unknown[: self._dead_time_index]
        decays = [self.model.free_responses(shape, times - times[0]) for times in self.times]
        columns = np.zeros((self.measured.size, 1 + sum(decay.shape[1] for decay in decays)))
        columns[:, 0] = 1.0
        row, column = 0, 1
        for decay in decays:
            rows, width = decay.shape
            columns[row : row + rows, column : column + width] = decay
            row, column = row + rows, column + width
        return columns

    def _per_stretch(self, unknown: Floats, compute: Callable[[Knots, Floats], Floats]) -> Floats:
        """(m,), result of `compute` for each stretch's commands after slew limit and delay."""
        slew, delay = self.slew(unknown), self.dead_time(unknown)
        commands = self.commands if slew is None else self._slew_limited(slew)
        pairs = zip(commands, self.times, strict=True)
        return np.concatenate([compute(knots, times - delay) for knots, times in pairs])

    def _slew_limited(self, slew: float) -> list[Knots]:
        """The commands after the slew limit; cached, because the search often repeats a limit."""
        if slew != self._slew_cache[0]:
            self._slew_cache = slew, [slewed(knots, slew) for knots in self.commands]
        return self._slew_cache[1]
