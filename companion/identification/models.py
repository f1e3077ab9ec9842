"""The two models of a rate loop that are fitted, each told by the logarithms of its shape."""

from math import exp
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from companion.identification.first_order_lag import Knots, lagged
from companion.identification.second_order_lag import second_order, second_order_decay

Floats = NDArray[np.float64]


class Model(Protocol):
    """A linear response of gain 1.

    Attributes:
        lowest: (k,), smallest shape that is searched.
        highest: (k,), the largest.
    """

    lowest: Floats
    highest: Floats

    def response(self, shape: Floats, commands: Knots, at: Floats) -> Floats:
        """What it makes of the commands, at the times (m,), begun at rest."""
        ...

    def decay(self, shape: Floats, since: Floats) -> Floats:
        """(m, k), how the state at the start dies away, `since` (m,) seconds later."""
        ...


class FirstOrder:
    """A lag; its shape is (log lag), s."""

    lowest, highest = np.log([0.001]), np.log([1.0])

    def response(self, shape: Floats, commands: Knots, at: Floats) -> Floats:
        """See `Model`."""
        return lagged(commands, exp(shape[0]), at)

    def decay(self, shape: Floats, since: Floats) -> Floats:
        """See `Model`."""
        return np.asarray(np.exp(-since / exp(shape[0])))[:, np.newaxis]


class SecondOrder:
    """ω and ζ; its shape is (log 2ζ/ω, log ζ): unlike ω and ζ these hardly depend on one another.

    2ζ/ω is by how much, s, it is late at a ramp.
    """

    lowest, highest = np.log([0.002, 0.2]), np.log([1.0, 4.0])

    def response(self, shape: Floats, commands: Knots, at: Floats) -> Floats:
        """See `Model`."""
        return second_order(commands, *frequency_damping(shape), at)

    def decay(self, shape: Floats, since: Floats) -> Floats:
        """See `Model`."""
        return second_order_decay(since, *frequency_damping(shape))


def frequency_damping(shape: Floats) -> tuple[float, float]:
    """ω (rad/s) and ζ of a `SecondOrder`."""
    damping = exp(shape[1])
    return 2.0 * damping / exp(shape[0]), damping
