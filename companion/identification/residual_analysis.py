"""Splits the residual of a fit: the part that the commands explain is misfit, the rest is noise.

Misfit is an error of the model, the same in each flight; misfit limits how well the model predicts.
Noise makes the results of flights differ, and the standard errors come from noise alone. The split
is a regression of the residual on the commands at many delays (a finite impulse response), which
explains as much as a linear model of any order can (Ljung, System Identification, 16.6).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from companion.least_squares import Floats, project

_MOST_DELAYS = 24
_SAMPLES_PER_DELAY = 8
"""Excited samples needed for each delay of the regression; with fewer it would fit the noise."""


@dataclass(frozen=True, slots=True)
class FitQuality:
    """Quality of a fit."""

    explained: float
    """R², share of the measurements' variance that the model explains."""
    misfit: float
    """Error of the model: RMS of the part of the residual that the commands explain, as a share of
    the standard deviation of the measurements. Noise is not included."""
    dead_time_error: float
    """Standard error of the dead time due to noise, s."""
    lag_error: float
    """Standard error of the lag due to noise, s."""
    span: float
    """Largest minus smallest command, after the slew limit, in the unit of the commands."""
    excited_samples: int
    """Number of samples at which the model differs from the command by more than 2 % of the span.
    Only such samples contain information on lag and dead time."""


def analyse_residual(
    residual: Floats,
    jacobian: Floats,
    commands: Callable[[float], Floats],
    response_duration: float,
    excited_samples: int,
    correlated_samples: int,
) -> tuple[float, Floats]:
    """Split a residual; with fewer than 8 excited samples, all of it counts as noise.

    Args:
        residual: (m,), measured − modelled.
        jacobian: (m, k), derivatives of the residual with respect to the unknowns; the effect of
            the linear unknowns is projected out.
        commands: function from an additional delay (s) to the commands of the model, (m,).
        response_duration: longest time for which the vehicle responds to a command, s.
        excited_samples: number of excited samples; see `FitQuality`.
        correlated_samples: number of samples over which the noise is correlated.

    Returns:
        The misfit, which is the RMS of the part that the commands explain, in the unit of the
            measurements; and the standard errors of the unknowns, (k,), in the unit of each.
    """
    delay_count = min(_MOST_DELAYS, excited_samples // _SAMPLES_PER_DELAY)
    noise = residual
    if delay_count:
        # Negative delays too, because the fitted dead time may be too long.
        delay_values = np.linspace(-0.25 * response_duration, response_duration, delay_count)
        columns = np.column_stack([commands(delay) for delay in delay_values.tolist()])
        _, noise = project(np.column_stack((columns, np.ones(residual.size))), residual)
    # The regression takes one degree of freedom for each delay.
    correction = excited_samples / max(excited_samples - delay_count, 1)
    standard_errors = _standard_errors(jacobian, noise, correlated_samples) * np.sqrt(correction)
    return float(np.sqrt(np.mean(np.square(residual - noise)))), standard_errors


def _standard_errors(jacobian: Floats, noise: Floats, correlated_samples: int) -> Floats:
    """(k,), standard errors of the unknowns that allow for correlated noise (Newey & West)."""
    scores = jacobian * noise[:, np.newaxis]
    score_covariance = scores.T @ scores
    for offset in range(1, min(correlated_samples, noise.size)):
        lagged_product = scores[offset:].T @ scores[:-offset]
        score_covariance += (1.0 - offset / correlated_samples) * (
            lagged_product + lagged_product.T
        )
    # Derivatives near the smallest float have no inverse: such unknowns are not determined.
    with np.errstate(over="ignore", invalid="ignore"):
        inverse = np.linalg.pinv(jacobian.T @ jacobian)
        errors: Floats = np.sqrt(np.maximum(np.diagonal(inverse @ score_covariance @ inverse), 0.0))
    return np.where(np.isnan(errors), np.inf, errors)
