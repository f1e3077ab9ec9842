"""How fast the vehicle's clock runs, from how the quickest samples' offset changes."""

from collections import deque
from math import inf

MOST_DRIFT = 0.02
"""The vehicle's clock is followed while its rate differs from ours by no more than this. Crystals
differ by less than 0.0002, a simulator that is slower than real time by 0.006 (measured)."""
_UNSURE = 0.005
"""By how much a measured rate may be wrong, or change while it is measured."""
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

    def spread(self, seconds: float) -> float:
        """How far apart the slowest and the quickest clock are after so many seconds, s."""
        return 2.0 * self._unsure * seconds

    def note(self, now: float, offset: float) -> None:
        """Take the quickest sample's offset (vehicle time minus ours), s, at `now`, once a second.

        Both in s. Two points far apart are enough: each is the best of a second's samples.
        """
        self.due = now + _PERIOD
        self._noted.append((now, offset))
        then, before = self._noted[0]
        if now - then < _LEAST * _PERIOD:
            return
        self._unsure = _UNSURE
        slope = (offset - before) / (now - then)
        self.rate = max(-MOST_DRIFT, min(MOST_DRIFT, slope))
        self.slowest = self.rate - self._unsure
