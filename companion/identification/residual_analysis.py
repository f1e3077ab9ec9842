"""The residual of a fit, split: the part that the commands explain is misfit, the rest is noise.

Misfit is an error of the model: it is the same in each flight, and says how wrong predictions are.
Noise makes the results of flights differ: the standard errors follow from it alone. The residual is
regressed on the commands at many delays (a finite impulse response), which explains whatever a
linear model of any order could (Ljung, System Identification, 16.6).
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from companion.least_squares import project

Floats = NDArray[np.float64]

_MOST_DELAYS = 24
_SAMPLES_PER_DELAY = 8
"""Excited samples needed for each delay: with fewer the regression would fit the noise."""


class Residuals(NamedTuple):
    """The two parts, and the standard errors of the unknowns.

    Attributes:
        misfit: root mean square of what the commands explain, in the measurements' unit.
        noise: root mean square of the rest.
        errors: (k,), standard errors of the unknowns.
    """

    misfit: float
    noise: float
    errors: Floats


def analyse(
    residual: Floats,
    slopes: Floats,
    commands: Callable[[float], Floats],
    memory: float,
    excited: int,
    correlated: int,
) -> Residuals:
    """Split a residual.

    Args:
        residual: (m,), measured − modelled.
        slopes: (m, k), how it changes with each unknown, the linear ones projected out.
        commands: delay in s → (m,), the commands that much later than the model has them.
        memory: s, over which the vehicle may remember commands.
        excited: number of excited samples.
        correlated: number of samples over which the noise is correlated.
    """
    delays = min(_MOST_DELAYS, excited // _SAMPLES_PER_DELAY)
    noise = residual
    if delays:
        # Also earlier than the model has it: its dead time may be too long for most of an answer.
        each = np.linspace(-0.25 * memory, memory, delays)
        columns = np.column_stack([commands(delay) for delay in each.tolist()])
        _, noise = project(np.column_stack((columns, np.ones(residual.size))), residual)
    lost = excited / max(excited - delays, 1)
    return Residuals(
        _rms(residual - noise), _rms(noise), _errors(slopes, noise, correlated) * np.sqrt(lost)
    )


def _errors(slopes: Floats, noise: Floats, correlated: int) -> Floats:
    """Standard errors that allow for correlated noise (Newey & West)."""
    scores = slopes * noise[:, np.newaxis]
    spread = scores.T @ scores
    for shift in range(1, min(correlated, noise.size)):
        shared = scores[shift:].T @ scores[:-shift]
        spread += (1.0 - shift / correlated) * (shared + shared.T)
    # Slopes near the smallest number there is have no inverse: nothing is determined by them.
    with np.errstate(over="ignore", invalid="ignore"):
        inverse = np.linalg.pinv(slopes.T @ slopes)
        errors: Floats = np.sqrt(np.maximum(np.diagonal(inverse @ spread @ inverse), 0.0))
    return np.where(np.isnan(errors), np.inf, errors)


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
