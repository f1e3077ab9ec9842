"""A first-order lag with dead time, fitted to stretches of commands and measurements of any unit.

y(t) = gain·x(t − dead time) + offset + what is left of the start, with x the lag's exact response
(`first_order_lag`). Gain, offset and starts are linear: only lag, dead time and slew are searched.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import exp, log, nan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from companion.fitting import Solution, minimise, project
from companion.identification.first_order_lag import Knots, held, lagged, slewed, value_at
from companion.identification.record import LONGEST_DEAD_TIME, Stretch, most_excited

Floats = NDArray[np.float64]

_TRIED_LAGS = np.geomspace(0.005, 1.0, 7)
_TRIED_DEAD_TIMES = np.linspace(0.0, 0.48, 25)
_RAMPS = (0.01, 0.5)
"""Shortest and longest time the largest change of command may take at the slew limit, s."""
_TRIED_RAMPS = (0.03, 0.06, 0.12, 0.25)
"""Of `_RAMPS`, those from which the search may begin, s."""
_LEFT_OF_LAG = (0.15, 0.4, 1.0)
_LEFT_OF_DEAD_TIME = (0.6, 1.0)
"""Of what was found without a slew limit, the shares from which the search with one may begin."""
_CLEARLY = 0.6
"""A slew limit is believed if it leaves less than this share of the squared residuals."""
_ON_ITS_WAY = 0.02
"""Excited: further from the command than this share of the commands' range."""
_ALIKE = 0.005
"""Commands that differ by less than this share of their range count as one."""
_COARSE = 500
"""About so many samples find where to begin."""
_FINE = 4000
"""At most so many samples find the rest: what more of them would add to the fit is time."""
_FEWEST = 10
_NEIGHBOUR = 0.005  # s


class Ranges(NamedTuple):
    """Between what is searched, s."""

    lag: tuple[float, float] = (0.001, 1.0)
    dead_time: tuple[float, float] = (0.0, LONGEST_DEAD_TIME - 0.01)


SEARCHED = Ranges()


@dataclass(frozen=True, slots=True)
class LagFit:
    """What was found; seconds, and the units of commands and measurements.

    Attributes:
        dead_time: s.
        lag: s.
        gain: measured per commanded, found freely even where lag and dead time are for a known one.
        offset: measured at a command of zero.
        slew: of the command, per second; None where there is no sign of a limit.
        explained: R².
        dead_time_error: standard error, s.
        lag_error: standard error, s.
        span: from the smallest to the largest command.
        excited: samples further from the command than 2 % of the span.
    """

    dead_time: float
    lag: float
    gain: float
    offset: float
    slew: float | None
    explained: float
    dead_time_error: float
    lag_error: float
    span: float
    excited: int


def fit_lag(
    record: list[Stretch], gain: float | None = None, *, may_slew: bool = True
) -> LagFit | None:
    """The best fit, or None where no command changed or next to nothing was measured.

    Args:
        record: what was commanded and measured.
        gain: what lag and dead time are to be found for; None finds it with them.
        may_slew: whether a slew limit is looked for.
    """
    record = most_excited(record)
    samples = sum(part.measured.size for part in record)
    if samples < _FEWEST or all(np.ptp(part.commanded) == 0.0 for part in record):
        return None
    data = _Data(record, gain, thinning=1 + samples // _FINE)
    coarse = _Data(record, gain, thinning=1 + samples // _COARSE)
    best = _settled(data, _start(coarse))
    if may_slew:
        best = _slewed_if_clearly(best, data, coarse)
    found = data.described(best)
    if gain is not None:
        freely = _Data(record, None, thinning=data.thinning).search(best.unknown)
        found = replace(found, gain=float(freely.weights[0]))
    return found


def _slewed_if_clearly(best: Solution, data: "_Data", coarse: "_Data") -> Solution:
    """The best fit behind a slew limit, if it is clearly better than the one without."""
    promising = coarse.search(_slewed_start(best, coarse))
    if promising.squares > _CLEARLY * coarse.search(best.unknown).squares:
        return best
    best_limited = data.search(promising.unknown)
    return best_limited if best_limited.squares < _CLEARLY * best.squares else best


def _slewed_start(best: Solution, coarse: "_Data") -> Floats:
    """(3,), the best of a coarse grid: what a ramp delays is taken from lag and dead time."""
    lag, dead_time = exp(best.unknown[0]), float(best.unknown[1])
    return coarse.best_of(
        [
            np.array([log(share * lag), left * dead_time, log(coarse.largest_change / ramp)])
            for ramp in _TRIED_RAMPS
            for share in _LEFT_OF_LAG
            for left in _LEFT_OF_DEAD_TIME
        ]
    )


class _Data:
    """A record, every `thinning`-th sample of it, and what a lag makes of its commands."""

    def __init__(self, record: list[Stretch], gain: float | None, thinning: int = 1) -> None:
        self.gain, self.thinning = gain, thinning
        span = max(float(np.ptp(part.commanded)) for part in record)
        self.commands = [held(part.time, part.commanded, _ALIKE * span) for part in record]
        self.times = [part.measured_time[::thinning] for part in record]
        self.measured = np.concatenate([part.measured[::thinning] for part in record])
        changes = [np.abs(np.diff(knots.value)).max(initial=0.0) for knots in self.commands]
        self.largest_change = float(max(changes))
        self._slewed: tuple[float, list[Knots]] = (nan, [])

    def projection(self, unknown: Floats) -> tuple[Floats, Floats]:
        """Weights (gain, offset, starts), and what they leave of the measurements (m,)."""
        moved = self.lagged(unknown)
        if self.gain is None:
            columns = np.column_stack((moved, self._drift(unknown)))
            return project(columns, self.measured)
        weights, residual = project(self._drift(unknown), self.measured - self.gain * moved)
        return np.concatenate(([self.gain], weights)), residual

    def lagged(self, unknown: Floats) -> Floats:
        """(m,), the delayed and lagged commands."""
        lag = exp(unknown[0])
        return self._each(unknown, lambda knots, at: lagged(knots, lag, at))

    def _drift(self, unknown: Floats) -> Floats:
        """(m, 1 + stretches): ones, and how the rate at each stretch's start dies away."""
        columns = np.zeros((self.measured.size, 1 + len(self.times)))
        columns[:, 0] = 1.0
        row = 0
        for number, (knots, times) in enumerate(zip(self.commands, self.times, strict=True)):
            since = times - unknown[1] - knots.time[0]
            columns[row : row + times.size, 1 + number] = np.exp(-since / exp(unknown[0]))
            row += times.size
        return columns

    def search(self, start: Floats) -> Solution:
        """The best fit near a start (log lag, dead time, and perhaps log slew)."""
        limits = [
            (log(SEARCHED.lag[0]), log(SEARCHED.lag[1])),
            SEARCHED.dead_time,
            (log(self.largest_change / _RAMPS[1]), log(self.largest_change / _RAMPS[0])),
        ]
        lowest, highest = np.array(limits[: start.size]).T
        return minimise(self.projection, start, lowest, highest)

    def best_of(self, points: list[Floats]) -> Floats:
        """The point of a grid that leaves the smallest squares."""
        residuals = [self.projection(point)[1] for point in points]
        return points[int(np.argmin([float(rest @ rest) for rest in residuals]))]

    def described(self, found: Solution) -> LagFit:
        """The fit in its own units."""
        lag = exp(found.unknown[0])
        spread = self.measured - self.measured.mean()
        asked = self._each(found.unknown[:2], value_at)
        span = float(np.ptp(asked))
        way = np.abs(self.lagged(found.unknown) - asked)
        return LagFit(
            dead_time=float(found.unknown[1]),
            lag=lag,
            gain=float(found.weights[0]),
            offset=float(found.weights[1]),
            slew=exp(found.unknown[2]) if found.unknown.size > 2 else None,
            explained=1.0 - found.squares / float(spread @ spread) if spread.any() else 0.0,
            dead_time_error=float(found.errors[1]),
            lag_error=lag * float(found.errors[0]),
            span=span,
            excited=int((way > _ON_ITS_WAY * span).sum()),
        )

    def _each(self, unknown: Floats, of: Callable[[Knots, Floats], Floats]) -> Floats:
        """(m,), of each stretch's commands (slewed, if that is in the unknowns), delayed."""
        commands = self._limited(unknown[2]) if unknown.size > 2 else self.commands
        each = zip(commands, self.times, strict=True)
        return np.concatenate([of(knots, times - unknown[1]) for knots, times in each])

    def _limited(self, log_slew: float) -> list[Knots]:
        """The slewed commands, kept until another slew is asked for: steps of the rest need it."""
        if log_slew != self._slewed[0]:
            self._slewed = log_slew, [slewed(knots, exp(log_slew)) for knots in self.commands]
        return self._slewed[1]


def _settled(data: _Data, start: Floats) -> Solution:
    """The best fit without a slew limit.

    Where commands and samples come at few distinct distances from each other, there is a shallow
    minimum at each, one sample apart and of the same delay as a whole: the neighbours are tried.
    """
    found = data.search(start)
    lag, dead_time = exp(found.unknown[0]), float(found.unknown[1])
    neighbours = [
        data.search(np.array([log(lag - shift), dead_time + shift]))
        for shift in (-_NEIGHBOUR, _NEIGHBOUR)
        if lag > shift
    ]
    return min(found, *neighbours, key=lambda each: each.squares)


def _start(data: _Data) -> Floats:
    """(2,), the best of a coarse grid: (log lag, dead time)."""
    return data.best_of(
        [np.array([log(lag), dead]) for lag in _TRIED_LAGS for dead in _TRIED_DEAD_TIMES]
    )
