"""Fits a first-order lag with dead time to commands and measurements of any unit.

Lag, dead time and slew limit are searched; linear regression gives gain, offset and initial states.
A second-order lag is tried too, and reported if it fits clearly better.
"""

from dataclasses import dataclass
from itertools import product
from math import exp, log, nan

import numpy as np

from companion.identification.delayed_model import (
    DelayedModel,
    FirstOrder,
    SecondOrder,
    SecondOrderFit,
    frequency_damping,
)
from companion.identification.record import Segment, most_excited_windows
from companion.identification.residual_analysis import FitQuality, analyse_residual
from companion.least_squares import Floats, Solution

LAG_RANGE = exp(FirstOrder.lower_bounds[0]), exp(FirstOrder.upper_bounds[0])
"""Range in which the lag is searched, s."""
_TRIED_LAGS = np.geomspace(0.005, 1.0, 7)
_TRIED_DEAD_TIMES = np.linspace(0.0, 0.48, 25)
_TRIED_RAMP_TIMES = (0.03, 0.06, 0.12, 0.25)
"""Starting points of the search for a slew limit: the time, s, that the largest change of the
commands takes at that limit."""
_LAG_SHARES = (0.15, 0.4, 1.0)
_DEAD_TIME_SHARES = (0.6, 1.0)
"""Starting points of the search with a slew limit: `_LAG_SHARES` of the lag and `_DEAD_TIME_SHARES`
of the dead time that were found without a slew limit."""
_CLEARLY_BETTER_SHARE = 0.6
"""Share of the simpler model's sum of squares below which a model with more unknowns is used."""
_TRIED_DAMPINGS = (0.4, 0.7, 1.0)
_TRIED_DEAD_TIME_SHARES = (0.0, 0.3, 0.6)
"""Tried dead times of a second-order model, as shares of the first-order lag + dead time."""
_EXCITED_SHARE = 0.02
"""Share of the commands' range by which the modelled response must differ from the command at an
excited sample."""
_RESPONSE_DURATION_FACTOR = 4.0
"""Duration of a step response, and correlation time of noise, as a multiple of lag + dead time."""
_COARSE_SAMPLES = 500
"""Approximate number of samples used to find the start of the search."""
_MOST_SAMPLES = 4000
"""Largest number of samples used for the fit: more take longer and change nothing."""
_FEWEST_SAMPLES = 10
_NEIGHBOUR_DISTANCE = 0.005
"""Distance in lag and dead time at which neighbouring minima are searched, s."""


@dataclass(frozen=True, slots=True)
class LagFit:
    """First order with dead time: lag·ẏ(t) = gain·u(t − dead_time) + offset − y(t).

    Units are those of the commands u and the measurements y. NaN: not found.
    """

    dead_time: float
    """Time from a sample to the first effect of its command, s."""
    lag: float
    """Time constant τ of the first-order lag, s."""
    gain: float
    """Steady measurement per command; fitted even if lag and dead time assume a given gain."""
    slew: float | None
    """Slew limit of the command, before the lag, per second; None: no limit was found."""
    fit: FitQuality
    second_order: SecondOrderFit | None = None
    """Second-order fit; None if it is not clearly better."""
    offset: float = nan
    """Measurement at a command of zero."""


def fit_lag(
    record: list[Segment], gain: float | None = None, *, search_slew_limit: bool = True
) -> LagFit | None:
    """The best first-order fit; None if no command changes, or there are fewer than 10 samples.

    Args:
        record: commands and measurements.
        gain: given gain, for which lag and dead time are fitted; None: the gain is fitted too.
        search_slew_limit: whether to search for a slew limit.
    """
    record = most_excited_windows(record)
    count = sum(segment.measured.size for segment in record)
    if count < _FEWEST_SAMPLES or all(np.ptp(segment.commanded) == 0.0 for segment in record):
        return None
    fine_thinning, coarse_thinning = 1 + count // _MOST_SAMPLES, 1 + count // _COARSE_SAMPLES
    fine_model = DelayedModel(record, FirstOrder(), gain, fine_thinning)
    coarse_model = DelayedModel(record, FirstOrder(), gain, coarse_thinning)
    grid = product(_TRIED_LAGS, _TRIED_DEAD_TIMES)
    start = coarse_model.best_of([np.array([log(lag), dead_time]) for lag, dead_time in grid])
    best = _best_without_slew(fine_model, start)
    if search_slew_limit:
        best = _with_slew_if_better(best, fine_model, coarse_model)
    free_gain_model, free_gain_solution = fine_model, best
    if gain is not None:
        free_gain_model = DelayedModel(record, FirstOrder(), None, fine_thinning)
        free_gain_solution = free_gain_model.search(best.unknowns)
    return LagFit(
        dead_time=fine_model.dead_time(best.unknowns),
        lag=exp(best.unknowns[0]),
        gain=float(free_gain_solution.weights[0]),
        slew=fine_model.slew(best.unknowns),
        fit=_quality(fine_model, best),
        second_order=_second_order_fit(
            record, free_gain_model, free_gain_solution, coarse_thinning
        ),
        offset=float(best.weights[1]),
    )


def _with_slew_if_better(
    best: Solution, fine_model: DelayedModel, coarse_model: DelayedModel
) -> Solution:
    """The best fit with a slew limit if it is clearly better than `best`, else `best`."""
    coarse_solution = coarse_model.search(_slewed_start(best, coarse_model))
    if coarse_solution.rss > _CLEARLY_BETTER_SHARE * coarse_model.search(best.unknowns).rss:
        return best
    limited_solution = fine_model.search(coarse_solution.unknowns)
    return limited_solution if limited_solution.rss < _CLEARLY_BETTER_SHARE * best.rss else best


def _slewed_start(best: Solution, coarse_model: DelayedModel) -> Floats:
    """(3,), start of the search with a slew limit: the best point of a coarse grid.

    A slew limit delays too, so smaller lags and dead times than without it are tried.
    """
    lag, dead_time = exp(best.unknowns[0]), float(best.unknowns[1])
    log_slews = [log(coarse_model.largest_change / ramp_time) for ramp_time in _TRIED_RAMP_TIMES]
    return coarse_model.best_of(
        [
            np.array([log(lag_share * lag), dead_time_share * dead_time, log_slew])
            for log_slew, lag_share, dead_time_share in product(
                log_slews, _LAG_SHARES, _DEAD_TIME_SHARES
            )
        ]
    )


def _second_order_fit(
    record: list[Segment], first_order_model: DelayedModel, first_order: Solution, thinning: int
) -> SecondOrderFit | None:
    """The best second-order fit, gain included; None: not clearly better than first order."""
    lag, dead_time, *slew = first_order.unknowns.tolist()
    delay = exp(lag) + dead_time
    model = SecondOrder()
    start = DelayedModel(record, model, None, thinning).best_of(
        [
            np.array(
                [log((1.0 - dead_time_share) * delay), log(damping), dead_time_share * delay, *slew]
            )
            for damping in _TRIED_DAMPINGS
            for dead_time_share in _TRIED_DEAD_TIME_SHARES
        ]
    )
    delayed_model = DelayedModel(record, model, None, first_order_model.thinning)
    solution = delayed_model.search(start)
    if solution.rss > _CLEARLY_BETTER_SHARE * first_order.rss:
        return None
    frequency, damping = frequency_damping(solution.unknowns)
    return SecondOrderFit(
        frequency=frequency,
        damping=damping,
        dead_time=delayed_model.dead_time(solution.unknowns),
        gain=float(solution.weights[0]),
        slew=delayed_model.slew(solution.unknowns),
        fit=_quality(delayed_model, solution),
    )


def _quality(delayed_model: DelayedModel, solution: Solution) -> FitQuality:
    """The quality of a fit of either order."""
    unknowns, lag = solution.unknowns, exp(solution.unknowns[0])
    commands = delayed_model.delayed_commands(unknowns)
    span = float(np.ptp(commands))
    excited_samples = int(
        (np.abs(delayed_model.response(unknowns) - commands) > _EXCITED_SHARE * span).sum()
    )
    response_duration = _RESPONSE_DURATION_FACTOR * (lag + delayed_model.dead_time(unknowns))
    sample_period = float(np.median(np.diff(np.concatenate(delayed_model.times))))
    misfit, standard_errors = analyse_residual(
        solution.residual,
        solution.jacobian,
        lambda delay: delayed_model.delayed_commands(unknowns, delay),
        response_duration,
        excited_samples,
        correlated_samples=1 + int(response_duration / max(sample_period, 1e-4)),
    )
    deviation = float(np.std(delayed_model.measured))
    return FitQuality(
        explained=delayed_model.r_squared(solution),
        misfit=misfit / deviation if deviation > 0.0 else 0.0,
        dead_time_error=delayed_model.dead_time(standard_errors),
        lag_error=lag * float(standard_errors[0]),
        span=span,
        excited_samples=excited_samples,
    )


def _best_without_slew(delayed_model: DelayedModel, start: Floats) -> Solution:
    """The best fit without a slew limit.

    If samples come at regular times after commands, there are shallow minima one sample apart, with
    the same sum of lag and dead time. Neighbouring minima are therefore tried too.
    """
    solution = delayed_model.search(start)
    lag, dead_time = exp(solution.unknowns[0]), float(solution.unknowns[1])
    neighbours = [
        delayed_model.search(np.array([log(lag - shift), dead_time + shift]))
        for shift in (-_NEIGHBOUR_DISTANCE, _NEIGHBOUR_DISTANCE)
        if lag > shift
    ]
    return min(solution, *neighbours, key=lambda each: each.rss)
