"""Response of one axis to body rates: the fit, its quality, and when it must not be used."""

from dataclasses import dataclass

from numpy.typing import ArrayLike

from companion.identification.delayed_model import DEAD_TIMES, SecondOrderFit
from companion.identification.fit import LAGS, fit_lag
from companion.identification.record import stretches


class BadFitError(ValueError):
    """A fit must not be used; the message says why."""


@dataclass(frozen=True, slots=True)
class FitQuality:
    """Quality of a fit.

    Attributes:
        explained: R², share of the measurements' variance that the model explains.
        misfit: how far the model is off, as a share of the movement: the root mean square of what
            commands explain of the residual. The same in each flight.
        dead_time_error: standard error of the dead time, s, by noise: how far flights differ.
        lag_error: standard error of the lag, s, likewise.
        span: from the smallest to the largest command, rad/s.
        excited: samples at which the model was still on its way to the command (by 2 % of the span
            or more): only these tell of lag and dead time.
    """

    explained: float
    misfit: float
    dead_time_error: float
    lag_error: float
    span: float
    excited: int


@dataclass(frozen=True, slots=True)
class FitNeeds:
    """Requirements of a fit that may be used.

    Attributes:
        misfit: largest misfit, as a share of the movement.
        error: largest standard error of lag and dead time, s, or
        relative_error: as a share of lag + dead time, whichever is larger.
        span: smallest span of the commands, rad/s.
        excited: fewest excited samples.
        gain: smallest and largest gain; a rate loop that follows has about 1.
    """

    misfit: float = 0.3
    error: float = 0.003
    relative_error: float = 0.1
    span: float = 0.2
    excited: int = 20
    gain: tuple[float, float] = (0.8, 1.2)


NEEDS = FitNeeds()
_EDGE = 1e-6  # s


@dataclass(frozen=True, slots=True)
class RateResponse:
    """First order with dead time: lag·ω̇(t) = gain·ω_command(t − dead_time) + offset − ω(t).

    Attributes:
        dead_time: from the sample that a command answers to its first effect, s; NaN if not found.
        lag: time constant, s; NaN if not found.
        gain: of the steady rate, as measured; NaN if not found.
        slew: slew limit of the autopilot before the lag, rad/s²; None where none was found.
        fit: how good it is.
        second_order: the model that is clearly nearer, where one is.
    """

    dead_time: float
    lag: float
    gain: float
    slew: float | None
    fit: FitQuality
    second_order: SecondOrderFit | None = None

    def reason(self, needs: FitNeeds = NEEDS) -> str | None:
        """Why this must not be used, as a sentence without its stop; None if it may be."""
        fit, uncertain = self.fit, max(self.fit.dead_time_error, self.fit.lag_error)
        low, high = needs.gain
        faults = (
            (
                fit.span < needs.span,
                f"too little excitation: the commands span {fit.span:.2f} rad/s, "
                f"{needs.span:.2f} are needed",
            ),
            (
                _at_edge(self.dead_time, DEAD_TIMES),
                f"dead time is at the edge of the searched range, {1e3 * self.dead_time:.0f} ms",
            ),
            (
                _at_edge(self.lag, LAGS),
                f"lag is at the edge of the searched range, {1e3 * self.lag:.0f} ms",
            ),
            (
                fit.excited < needs.excited,
                f"too little excitation: {fit.excited} samples show the response, "
                f"{needs.excited} are needed",
            ),
            (
                fit.misfit > needs.misfit,
                f"poor fit: the model is off by {fit.misfit:.0%} of the movement, "
                f"at most {needs.misfit:.0%} may be",
            ),
            (
                not low <= self.gain <= high,
                f"gain {self.gain:.2f} is not near 1: the rates did not follow the commands",
            ),
            (
                uncertain > max(needs.error, needs.relative_error * (self.lag + self.dead_time)),
                f"lag and dead time are uncertain by {1e3 * uncertain:.1f} ms",
            ),
        )
        return next((text for wrong, text in faults if wrong), None)

    def is_good(self, needs: FitNeeds = NEEDS) -> bool:
        """Whether it may be used: there is no `reason` against it."""
        return self.reason(needs) is None


def _at_edge(value: float, searched: tuple[float, float]) -> bool:
    return not searched[0] + _EDGE < value < searched[1] - _EDGE


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
    """Least squares of a first-order lag with dead time, and with a slew limit where there is one.

    Commands are held from their times on; a pause of more than 0.5 s ends a stretch of control.
    The first half second of each stretch is left out, since commands before it would act on it. A
    constant offset of the measurements and the rate at the start of each stretch are found too.

    To tell a slew limit from a slow lag, commands of clearly different size are needed.

    Args:
        time: (n,), vehicle time of the sample that each command answered, s.
        commanded: (n,), body rates of one axis, rad/s; rows that are not finite are left out.
        measured_time: (m,), vehicle time, s; need not be regular.
        measured: (m,), body rates, rad/s; rows that are not finite are left out.
        gain: given gain, for which lag and dead time are fitted, such as the 1 that planners
            assume. None fits it too.

    Returns:
        The response; without any change of command, one of NaN whose `reason` says so.

    Raises:
        ValueError: a time series and its values are not two rows of equal length.
    """
    found = fit_lag(stretches(time, commanded, measured_time, measured), gain)
    if found is None:
        return _NOT_FOUND
    quality = FitQuality(
        found.explained,
        found.misfit,
        found.dead_time_error,
        found.lag_error,
        found.span,
        found.excited,
    )
    nearer = found.second_order
    gain_found = found.gain if nearer is None else nearer.gain
    return RateResponse(found.dead_time, found.lag, gain_found, found.slew, quality, nearer)
