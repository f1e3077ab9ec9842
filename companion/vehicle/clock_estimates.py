"""Two estimates about the vehicle's clock: how fast it runs, and how late the quickest sample is.

The rate is the slope of the quickest samples' offset; the delay is what TIMESYNC adds to it.
"""

from collections import deque
from enum import Enum
from math import inf
from typing import NamedTuple

MOST_DRIFT = 0.02
"""The vehicle's clock is followed while its rate differs from ours by no more than this. Crystals
differ by less than 0.0002, a simulator that is slower than real time by 0.006 (measured)."""
_UNSURE = 0.005
"""By how much a measured rate may be wrong, or change while it is measured."""
_NO_DRIFT = 0.005
"""If the offset rises by more than the drift and this, s, from one note to the next, samples came
late until then. From a backlog of 68 ms at the start (measured on PX4) a rate of 1.4 % would
be measured, and samples would seem up to 79 ms old for 40 s."""
_PERIOD = 1.0
_LEAST, _MOST = 5, 20
"""A rate is measured over this many seconds at least and at most."""

LIFETIME = 20.0
"""An exchange counts for this long, s; they come once a second."""
_LONGEST = 10.0
"""No link keeps a sample longer, s: a greater difference is another clock's."""
_TOLERATED = 0.05
"""By how much TIMESYNC may lag the samples' stamps, s; the simulators' does by up to 0.012."""


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
        """Restart the measurement: the noted offsets are of late samples."""
        self._noted.clear()
        self.rate, self._unsure = 0.0, MOST_DRIFT
        self.slowest = -MOST_DRIFT

    def spread(self, seconds: float) -> float:
        """How far apart the slowest and the fastest possible clock are after `seconds`, s."""
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


class DelayUnknown(Enum):
    """Why the delay is not known."""

    UNANSWERED = "the autopilot does not answer TIMESYNC"
    OTHER_CLOCK = "TIMESYNC counts another clock than time_boot_ms"


class _Compared(NamedTuple):
    at: float
    half: float
    delay: float

    def error(self, now: float) -> float:
        """By how much its delay may be wrong at `now`, s."""
        return self.half + MOST_DRIFT * (now - self.at)


class TelemetryDelay:
    """The delay of the quickest sample, from the best recent exchange.

    An exchange's error is half its round trip. It grows with its age, since what the samples tell
    of the clock's rate may be a queue that grows.

    Attributes:
        known: Whether there is a delay.
        seconds: The delay, s; 0 while it is not known.
        error: It may be wrong by this, s.
        unknown: Why it is not known, where it is not.
    """

    def __init__(self) -> None:
        self.known = False
        self.seconds = self.error = 0.0
        self.unknown = DelayUnknown.UNANSWERED
        self._compared: deque[_Compared] = deque(maxlen=round(LIFETIME) + 10)
        self._odd: _Compared | None = None

    def compare(self, now: float, half: float, delay: float) -> float | None:
        """Take an exchange, unless no delay of the samples explains it.

        Args:
            now: s on our clock.
            half: Half of its round trip, s.
            delay: TIMESYNC's offset minus the quickest sample's, s.

        Returns:
            By how much TIMESYNC has come to lag the samples' stamps, s, if it agreed with them
            before and two exchanges in a row say so; else None.
        """
        taken = _Compared(now, half, delay)
        if -(half + _TOLERATED) <= delay <= _LONGEST:
            self._odd = None
            self.unknown = DelayUnknown.UNANSWERED
            self._compared.append(taken)
            self.expire(now)
            return None
        before, self._odd = self._odd, taken
        if before is None or abs(before.delay - delay) > before.half + half + _TOLERATED:
            return None
        self._odd = None
        if self._compared and delay < 0.0:
            return self.seconds - delay
        self.forget(DelayUnknown.OTHER_CLOCK)
        return None

    def most(self, before: float) -> float:
        """The largest delay that exchanges up to `before` (s on our clock) leave possible, s."""
        told = [each for each in self._compared if each.at <= before]
        if not told:
            return 0.0
        best = min(told, key=lambda each: each.error(before))
        return best.delay + best.error(before)

    def shorten(self, by: float, now: float) -> None:
        """The quickest sample is `by` s quicker than those that were compared with; both in s."""
        self._compared = deque(
            (each._replace(delay=each.delay - by) for each in self._compared),
            maxlen=self._compared.maxlen,
        )
        self.expire(now)

    def retract(self, since: float) -> None:
        """Forget what was compared after `since`, s on our clock: the clock had changed already."""
        while self._compared and self._compared[-1].at > since:
            self._compared.pop()
        self.expire(since)

    def forget(self, why: DelayUnknown) -> None:
        """The delay is not known any more."""
        self._compared.clear()
        self.known, self.unknown = False, why
        self.seconds = self.error = 0.0

    def expire(self, now: float) -> None:
        """Forget exchanges that are too old, and choose the best of the others."""
        compared = self._compared
        while compared and now - compared[0].at > LIFETIME:
            compared.popleft()
        if not compared:
            self.forget(self.unknown)
            return
        self.known = True
        best = min(compared, key=lambda each: each.error(now))
        self.seconds = max(0.0, best.delay)
        self.error = best.error(now)
