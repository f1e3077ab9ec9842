"""Lags over one sample, exact while what they follow is held."""

from math import exp, sqrt

from companion.attitude.reference import SecondOrderReference


def behind(rate: float, aim: float, lag: float, dt: float) -> tuple[float, float]:
    """How far a rate moves on within `dt` on its way to `aim`, and the rate then.

    lag·ṙ = aim − r; `lag` and `dt` in s, the way in the rate's unit times s.
    """
    kept = exp(-dt / lag)
    return aim * dt + (rate - aim) * lag * (1.0 - kept), aim + (rate - aim) * kept


class Lag:
    """square·r̈ + lag·ṙ = aim − r.

    Args:
        lag: s.
        square: s²; 0 makes it first order.
    """

    __slots__ = ("_lag", "_model", "_square")

    def __init__(self, lag: float, square: float = 0.0) -> None:
        self._lag, self._square = lag, square
        self._model = None
        if square > 0.0:
            self._model = SecondOrderReference(1.0 / sqrt(square), 0.5 * lag / sqrt(square))

    def after(self, rate: float, slope: float, aim: float, dt: float) -> tuple[float, float, float]:
        """How far a rate moves on within `dt`, the rate then, and its slope.

        Args:
            rate: in any unit.
            slope: its change a second; without effect in first order.
            aim: held, in the rate's unit.
            dt: s.
        """
        if self._model is None:
            moved, later = behind(rate, aim, self._lag, dt)
            return moved, later, (aim - later) / self._lag
        left, from_slope, falls, kept = self._model.transition(dt)
        later = aim + left * (rate - aim) + from_slope * slope
        steeper = falls * (rate - aim) + kept * slope
        moved = aim * dt - self._lag * (later - rate) - self._square * (steeper - slope)
        return moved, later, steeper
