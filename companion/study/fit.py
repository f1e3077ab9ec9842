"""The second-order model with a dead time that a response comes nearest to."""

from math import exp, log
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from companion.attitude import Coefficients
from companion.attitude.reference import SecondOrderReference
from companion.study.step import Floats, Step

_THINNING = 10
_REST = Coefficients(0.0, 0.0)
_LONGEST_DEAD_TIME = 0.5  # s


FIT_COLUMNS = ("second order: dead time, ms", "second order: ω, rad/s", "second order: ζ")


class SecondOrderFit(NamedTuple):
    """A second-order model that begins to move `dead_time` seconds after the step."""

    model: SecondOrderReference
    dead_time: float

    @property
    def cells(self) -> tuple[float, float, float]:
        """What stands in a table under `FIT_COLUMNS`."""
        return 1e3 * self.dead_time, self.model.frequency, self.model.damping


def second_order_path(step: Step, fit: SecondOrderFit, time: Floats) -> Floats:
    """(n, 2) coefficients of the model, from rest, at the times (n,) in s after the step."""
    moving = np.maximum(time - fit.dead_time, 0.0)
    return np.array([fit.model.after(step.start, _REST, step.target, float(t))[0] for t in moving])


def fit_second_order(step: Step, path: Floats) -> SecondOrderFit:
    """Least squares over frequency, damping and dead time.

    Args:
        step: what was flown.
        path: (samples + 1, 2) coefficients.
    """
    time, measured = step.time[::_THINNING], path[::_THINNING]

    def apart(unknown: Floats) -> Floats:
        return np.asarray((second_order_path(step, _fit(unknown), time) - measured).ravel())

    start = [log(2.0 * step.gain), 0.0, 1.0 / step.rate_hz]
    bounds = ([-np.inf, -np.inf, 0.0], [np.inf, np.inf, _LONGEST_DEAD_TIME])
    return _fit(least_squares(apart, start, bounds=bounds).x)


def _fit(unknown: Floats) -> SecondOrderFit:
    frequency, damping, dead_time = (float(value) for value in unknown)
    return SecondOrderFit(SecondOrderReference(exp(frequency), exp(damping)), dead_time)
