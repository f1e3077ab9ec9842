"""Response of one axis to commanded rates: the fit, its quality, and whether it may be used."""

from dataclasses import dataclass
from math import isnan

from numpy.typing import ArrayLike

from companion.identification.delayed_model import DEAD_TIME_RANGE
from companion.identification.fit import LAG_RANGE, LagFit, fit_lag
from companion.identification.record import segments
from companion.identification.residual_analysis import FitQuality


class BadFitError(ValueError):
    """A fit must not be used; the message says why."""


@dataclass(frozen=True, slots=True)
class FitNeeds:
    """Requirements that a fit must meet to be used; see `FitQuality`."""

    misfit: float = 0.3
    """Largest `FitQuality.misfit`, a share of the standard deviation of the measurements."""
    error: float = 0.003
    """Largest standard error of lag and dead time, s; see `relative_error`."""
    relative_error: float = 0.1
    """Largest standard error of lag and dead time, as a share of lag + dead time. The larger of
    this limit and `error` applies."""
    span: float = 0.2
    """Smallest span of the commands, rad/s."""
    excited_samples: int = 20
    """Smallest number of excited samples; see `FitQuality.excited_samples`."""
    gain: tuple[float, float] = (0.8, 1.2)
    """Smallest and largest gain; a working rate loop has a gain of about 1."""


DEFAULT_NEEDS = FitNeeds()
_EDGE_TOLERANCE = 1e-6  # s


@dataclass(frozen=True, slots=True)
class RateResponse(LagFit):
    """A `LagFit` of a body rate, in rad/s. If there is a second-order fit, `gain` is its gain."""

    def flaw(self, needs: FitNeeds = DEFAULT_NEEDS) -> str | None:
        """Reason why this fit must not be used, without full stop; None if it may be used."""
        fit, uncertainty = self.fit, max(self.fit.dead_time_error, self.fit.lag_error)
        lowest_gain, highest_gain = needs.gain
        flaws = (
            (
                isnan(self.dead_time) and fit.span == 0.0,
                "too little excitation: no command changed while rates were measured; commands and "
                "rates need times in s on one clock, and commands must be at most 0.5 s apart",
            ),
            (
                fit.span < needs.span,
                f"too little excitation: the commands span {fit.span:.2f} rad/s, "
                f"{needs.span:.2f} are needed",
            ),
            (
                _at_edge(self.dead_time, DEAD_TIME_RANGE),
                f"dead time is at the edge of the searched range, {1e3 * self.dead_time:.0f} ms",
            ),
            (
                _at_edge(self.lag, LAG_RANGE),
                f"lag is at the edge of the searched range, {1e3 * self.lag:.0f} ms",
            ),
            (
                fit.excited_samples < needs.excited_samples,
                f"too little excitation: {fit.excited_samples} samples show the response, "
                f"{needs.excited_samples} are needed",
            ),
            (
                fit.misfit > needs.misfit,
                f"poor fit: the model's error is {fit.misfit:.0%} of the rates' standard "
                f"deviation, more than {needs.misfit:.0%}",
            ),
            (
                not lowest_gain <= self.gain <= highest_gain,
                f"gain {self.gain:.2f} is not near 1: the rates did not follow the commands",
            ),
            (
                uncertainty > max(needs.error, needs.relative_error * (self.lag + self.dead_time)),
                f"lag and dead time are uncertain by {1e3 * uncertainty:.1f} ms",
            ),
        )
        return next((text for is_flawed, text in flaws if is_flawed), None)

    def is_good(self, needs: FitNeeds = DEFAULT_NEEDS) -> bool:
        """Whether the fit may be used: it has no `flaw`."""
        return self.flaw(needs) is None


def _at_edge(value: float, searched_range: tuple[float, float]) -> bool:
    return not searched_range[0] + _EDGE_TOLERANCE < value < searched_range[1] - _EDGE_TOLERANCE


_NOT_FOUND = RateResponse(
    *(3 * (float("nan"),)), slew=None, fit=FitQuality(0.0, 0.0, float("inf"), float("inf"), 0.0, 0)
)


def fit_rate_response(
    time: ArrayLike,
    commanded: ArrayLike,
    measured_time: ArrayLike,
    measured: ArrayLike,
    gain: float | None = None,
) -> RateResponse:
    """Fit a first-order lag with dead time, and with a slew limit if there is one (least squares).

    Each command is held until the next; a pause of more than 0.5 s ends a segment of control. The
    first half second of each segment is left out, since it depends on commands before the segment.
    A constant offset of the measurements and the rate at the start of each segment are fitted too.

    A slew limit differs visibly from a slow lag only if some commands are much larger than others.

    Args:
        time: (n,), vehicle time of the sample to which each command responds, s.
        commanded: (n,), body rates of one axis, rad/s; rows that are not finite are left out.
        measured_time: (m,), vehicle time, s; need not be regular.
        measured: (m,), body rates, rad/s; rows that are not finite are left out.
        gain: given gain, for which lag and dead time are fitted; planners assume 1. None: the gain
            is fitted too.

    Returns:
        The response. If no command changed or there are fewer than 10 samples, its values are NaN
        and its `flaw` is too little excitation.

    Raises:
        ValueError: a time series and its values are not one-dimensional and equally long.
    """
    fit = fit_lag(segments(time, commanded, measured_time, measured), gain)
    if fit is None:
        return _NOT_FOUND
    gain = fit.gain if fit.second_order is None else fit.second_order.gain
    return RateResponse(
        fit.dead_time, fit.lag, gain, fit.slew, fit.fit, fit.second_order, fit.offset
    )
