"""How fast the vehicle's clock runs, from how the quickest samples' offset changes."""

from collections import deque
from math import inf

MOST_DRIFT = 0.02
"""The vehicle's clock is followed while its rate differs from ours by no more than this. Crystals
differ by less than 0.0002, a simulator that is slower than real time by 0.006 (measured)."""
_UNSURE = 0.005
"""By how much a measured rate may be wrong, or change while it is measured."""
_NO_DRIFT = 0.005
"""Offsets that rise by more than the drift and this, s, from one note to the next: the samples had
come late until then. From a backlog of 68 ms at the start (measured on PX4) a rate of 1.4 % would
be measured, and samples would seem up to 79 ms old for 40 s."""
_PERIOD = 1.0
_LEAST, _MOST = 5, 20
"""A rate is measured over this many seconds at least and at most."""


class ClockRate:
    """Estimates the rate of the vehicle's clock.

    Attributes:
        rate: How much faster than ours the vehicle's clock runs, s per s.
        slowest: The lowest rate that it may have just now: the offset may sink as quickly.
        due: When the next offset is to be noted, s on our clock.

    Args:
        fixed: The two clocks are one.
    """

    def __init__(self, *, fixed: bool = False) -> None:
        self.rate = 0.0
        self.due = inf if fixed else -inf
        self._unsure = 0.0 if fixed else MOST_DRIFT
        self.slowest = -self._unsure
        self._noted: deque[tuple[float, float]] = deque(maxlen=_MOST + 1)

    def _restart(self) -> None:
        """Measure the rate anew: what was noted so far is of late samples."""
        self._noted.clear()
        self.rate, self._unsure = 0.0, MOST_DRIFT
        self.slowest = -MOST_DRIFT

    def spread(self, seconds: float) -> float:
        """How far apart the slowest and the quickest clock are after so many seconds, s."""
        return 2.0 * self._unsure * seconds

    def note(self, now: float, offset: float) -> None:
        """Take the quickest sample's offset (vehicle time minus ours), s, at `now`, once a second.

        Both in s. Two points far apart are enough: each is the best of a second's samples.
        """
        if self._noted:
            then, before = self._noted[-1]
            if offset - before > MOST_DRIFT * (now - then) + _NO_DRIFT:
                self._restart()
        self.due = now + _PERIOD
        self._noted.append((now, offset))
        then, before = self._noted[0]
        if now - then < _LEAST * _PERIOD:
            return
        self._unsure = _UNSURE
        slope = (offset - before) / (now - then)
        self.rate = max(-MOST_DRIFT, min(MOST_DRIFT, slope))
        self.slowest = self.rate - self._unsure
