"""What lies between thrust and the 0..1 that commands it: the rotors' curve, and the battery."""

from math import isfinite, sqrt

_SMOOTHING = 0.3
"""Time constant of the voltage, s; ArduPilot's (MOT_BAT_V_MAX) is filtered at 0.5 Hz."""

_PLAUSIBLE = 0.6, 1.2
"""A voltage further from where it began is a broken reading and no sag."""


class ThrustCurve:
    """share = factor·u² + (1 − factor)·u: the share of full thrust over the signal, both 0..1.

    PX4's THR_MDL_FAC and ArduPilot's MOT_THST_EXPO are this factor.

    Args:
        factor: 0 for a straight line up to 1 for a parabola.
    """

    def __init__(self, factor: float) -> None:
        self._factor = factor

    def share(self, signal: float) -> float:
        """The share of full thrust that a signal gives."""
        return signal * (1.0 + self._factor * (signal - 1.0))

    def signal(self, share: float) -> float:
        """The signal that gives a share of full thrust; the inverse of `share`."""
        factor = self._factor
        if factor == 0.0:
            return share
        linear = 1.0 - factor
        # The root of the quadratic in the form that stays exact for a small factor.
        return 2.0 * share / (linear + sqrt(linear * linear + 4.0 * factor * share))


class BatterySag:
    """How much thrust is left of what the battery gave in the air at first: (V/V₀)^exponent.

    The configured hover thrust holds for a vehicle that hovers, so V₀ is the first voltage in the
    air, under load.

    Attributes:
        factor: of the thrust; 1 while the voltage is not known.

    Args:
        exponent: 2 for plain speed controllers, whose rotors turn as fast as the voltage allows; 0
            where the autopilot or the speed controllers see to it.
    """

    def __init__(self, exponent: float) -> None:
        self.factor = 1.0
        self._exponent = exponent
        self._first: float | None = None
        self._ratio = 1.0
        self._time = 0.0

    def reset(self) -> None:
        """On the ground: the next voltage is V₀."""
        self._first = None
        self._ratio = self.factor = 1.0

    def note(self, time: float, voltage: float | None) -> None:
        """Take the whole battery's voltage in V, at a time in s; None or garbage is no news."""
        if voltage is None or not isfinite(voltage) or voltage <= 0.0 or self._exponent == 0.0:
            return
        if self._first is None:
            self._first = voltage
        passed, self._time = time - self._time, time
        ratio = voltage / self._first
        if passed > 0.0 and _PLAUSIBLE[0] < ratio < _PLAUSIBLE[1]:
            self._ratio += passed / (passed + _SMOOTHING) * (ratio - self._ratio)
            self.factor = self._ratio**self._exponent
