"""Stability margins of a loop from its frequency response (Nyquist)."""

from functools import cache
from math import degrees, inf, log10
from typing import NamedTuple

import numpy as np

from companion.tuning.feedback import Complex

_REAL_PART_OF_S = 1e-2
"""Real part of the frequencies s, 1/s; the integrators at s = 0 lie to the left of them."""
_HIGHEST_FREQUENCY = 150.0
"""Highest frequency of the analysis, rad/s; the Nyquist frequency of guidance at 50 Hz is 157."""
_FREQUENCY_COUNT = 120


@cache
def frequencies() -> Complex:
    """Complex frequencies s (n,) for margins and errors, rad/s.

    The real part is `_REAL_PART_OF_S`. The imaginary part rises from 0 to `_HIGHEST_FREQUENCY`,
    with most points above 0.05 rad/s.
    """
    low = np.geomspace(1e-3, 0.05, 12)[:-1]
    high = np.geomspace(0.05, _HIGHEST_FREQUENCY, _FREQUENCY_COUNT)
    s: Complex = _REAL_PART_OF_S + 1j * np.concatenate([[0.0], low, high])
    s.setflags(write=False)
    return s


class Margins(NamedTuple):
    """Stability margins of one loop."""

    gain_db: float
    """Gain margin, dB: the smaller of the rise and the fall of the gain that the loop tolerates;
    infinite if the phase never crosses -180°."""
    phase_deg: float
    """Phase margin, degrees; infinite if the gain never crosses 1."""
    delay: float
    """Delay margin, s; infinite if the gain never crosses 1."""
    stable: bool
    """Whether the closed loop is stable. If not, the margins are its distance from stability."""

    def sentence(self) -> str:
        """Text for the user: the margins, or "unstable"."""
        if not self.stable:
            return "unstable"
        delay = 1e3 * self.delay
        return f"{self.gain_db:.1f} dB, {self.phase_deg:.0f}°, {delay:.0f} ms of added delay"


def margins(s: Complex, loop_gain: Complex) -> Margins:
    """The margins of a loop whose open loop is stable.

    The closed loop is stable if 1 + L does not encircle 0. L is real at the first frequency.

    Args:
        s: (n,), result of `frequencies`.
        loop_gain: (n,), loop gain L at `s`.
    """
    omega, gain = s.imag, np.abs(loop_gain)
    phase = np.unwrap(np.angle(loop_gain))
    angle = np.unwrap(np.angle(1.0 + loop_gain))
    stable = abs(angle[-1] - angle[0]) < 1.0 and loop_gain[0].real > -1.0
    gain_db, phase_margin, delay = inf, inf, inf
    turns = (phase + np.pi) / (2.0 * np.pi)  # a whole number where the phase crosses -180°
    for k in np.flatnonzero(np.floor(turns[1:]) != np.floor(turns[:-1])):
        crossing = max(np.floor(turns[k]), np.floor(turns[k + 1]))
        fraction = (crossing - turns[k]) / (turns[k + 1] - turns[k])
        log_gain = (1.0 - fraction) * log10(gain[k]) + fraction * log10(gain[k + 1])
        gain_db = min(gain_db, abs(20.0 * log_gain))
    for k in np.flatnonzero((gain[1:] > 1.0) != (gain[:-1] > 1.0)):
        fraction = log10(gain[k]) / log10(gain[k] / gain[k + 1])
        phase_at_crossing = phase[k] + fraction * (phase[k + 1] - phase[k])
        frequency = omega[k] + fraction * (omega[k + 1] - omega[k])
        margin = (phase_at_crossing + np.pi) % (2.0 * np.pi)
        delay = min(delay, margin / frequency)
        phase_margin = min(phase_margin, margin, 2.0 * np.pi - margin)
    return Margins(gain_db, degrees(phase_margin), delay, bool(stable))


def smaller_margins(one: Margins, other: Margins) -> Margins:
    """The smaller value of each margin of two loops; stable only if both loops are stable."""
    return Margins(
        min(one.gain_db, other.gain_db),
        min(one.phase_deg, other.phase_deg),
        min(one.delay, other.delay),
        one.stable and other.stable,
    )
