"""The second-order model that a response comes nearest to."""

from math import exp, log

import numpy as np
from scipy.optimize import least_squares

from companion.attitude import Coefficients
from companion.attitude.reference import SecondOrderReference
from companion.study.step import Floats, Step

_THINNING = 10
_REST = Coefficients(0.0, 0.0)


def second_order_path(step: Step, model: SecondOrderReference, time: Floats) -> Floats:
    """(n, 2) coefficients of a second-order model that starts at rest, at the times (n,) in s."""
    return np.array([model.after(step.start, _REST, step.target, float(t))[0] for t in time])


def fit_second_order(step: Step, path: Floats) -> SecondOrderReference:
    """Least squares over frequency and damping.

    Args:
        step: what was flown.
        path: (samples + 1, 2) coefficients.
    """
    time, measured = step.time[::_THINNING], path[::_THINNING]

    def apart(logarithms: Floats) -> Floats:
        frequency, damping = np.exp(logarithms)
        model = SecondOrderReference(float(frequency), float(damping))
        return np.asarray((second_order_path(step, model, time) - measured).ravel())

    found = least_squares(apart, [log(2.0 * step.gain), 0.0])
    return SecondOrderReference(exp(float(found.x[0])), exp(float(found.x[1])))
