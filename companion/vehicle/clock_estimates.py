"""Two estimates about the vehicle's clock: its rate, and the delay of the quickest sample.

`clock.py` explains "quickest" and "offset". The rate is the slope of the quickest samples' offset.
The delay is TIMESYNC's offset minus the quickest sample's offset.
"""

from collections import deque
from enum import Enum
from math import inf
from typing import NamedTuple

MAX_DRIFT = 0.02
"""Largest assumed difference in rate between the two clocks, s per s. Crystals differ by less than
0.0002; a simulator that ran slower than real time differed by 0.006."""
_RATE_UNCERTAINTY = 0.005
"""Uncertainty of a measured rate, s per s."""
_MAX_OFFSET_RISE = 0.005
"""Rise of the offset beyond what drift explains, s, which shows that earlier samples were late. The
measurement of the rate then restarts. Otherwise a backlog of 68 ms at the start (measured on PX4)
would give a rate of 1.4 %, and samples would seem up to 79 ms old for 40 s.
"""
_OFFSET_PERIOD = 1.0
"""Time between two offsets that are noted to measure the rate, s."""
_MIN_WINDOW, _MAX_WINDOW = 5, 20
"""Shortest and longest time over which a rate is measured, s."""

EXCHANGE_LIFETIME = 20.0
"""Time for which a TIMESYNC exchange is used, s; there is one each second."""
_MAX_DELAY = 10.0
"""Largest plausible delay of a sample, s; a larger one means that TIMESYNC uses another clock."""
_MAX_TIMESYNC_LAG = 0.05
"""Tolerated lag of TIMESYNC behind the samples' stamps, s; in the simulators up to 0.012."""


class ClockRate:
    """Estimates the rate of the vehicle's clock.

    Args:
        same_clock: whether the vehicle and the loop have the same clock.

    Attributes:
        rate: rate of the vehicle's clock minus that of the loop's clock, s per s.
        lowest_rate: the lowest rate that is possible now, s per s.
        next_offset_due: event-loop time at which the next offset should be noted, s.
    """

    def __init__(self, *, same_clock: bool) -> None:
        self.rate = 0.0
        self.next_offset_due = inf if same_clock else -inf
        self._rate_error = 0.0 if same_clock else MAX_DRIFT
        self.lowest_rate = -self._rate_error
        self._offsets: deque[tuple[float, float]] = deque(maxlen=_MAX_WINDOW + 1)

    def spread(self, seconds: float) -> float:
        """Difference between the fastest and the slowest possible clock after `seconds`, s."""
        return 2.0 * self._rate_error * seconds

    def add_offset(self, now: float, offset: float) -> None:
        """Take the quickest sample's offset (vehicle time minus event-loop time) once a second.

        Two offsets far apart suffice for the rate, because each is from the quickest sample.

        Args:
            now: event-loop time, s.
            offset: the offset, s.
        """
        if self._offsets:
            earlier_time, earlier_offset = self._offsets[-1]
            if offset - earlier_offset > MAX_DRIFT * (now - earlier_time) + _MAX_OFFSET_RISE:
                self._offsets.clear()  # the noted offsets are of late samples
                self.rate, self._rate_error = 0.0, MAX_DRIFT
                self.lowest_rate = -MAX_DRIFT
        self.next_offset_due = now + _OFFSET_PERIOD
        self._offsets.append((now, offset))
        earlier_time, earlier_offset = self._offsets[0]
        if now - earlier_time < _MIN_WINDOW * _OFFSET_PERIOD:
            return
        self._rate_error = _RATE_UNCERTAINTY
        slope = (offset - earlier_offset) / (now - earlier_time)
        self.rate = max(-MAX_DRIFT, min(MAX_DRIFT, slope))
        self.lowest_rate = self.rate - self._rate_error


class DelayUnknown(Enum):
    """Why the delay of the quickest sample is not known."""

    UNANSWERED = "the autopilot does not answer TIMESYNC"
    OTHER_CLOCK = "TIMESYNC uses a different clock than time_boot_ms"


class _Exchange(NamedTuple):
    """A TIMESYNC exchange."""

    answered_at: float
    """Event-loop time of the answer, s."""
    initial_error: float
    """Largest possible error of `delay` at the time of the answer, s."""
    delay: float
    """TIMESYNC's offset minus the quickest sample's, s."""

    def error(self, now: float) -> float:
        """Largest possible error of `delay` at the event-loop time `now`, s."""
        return self.initial_error + MAX_DRIFT * (now - self.answered_at)


class TelemetryDelay:
    """The delay of the quickest sample, from the TIMESYNC exchange with the smallest error bound.

    The error bound of an exchange grows with its age, by `MAX_DRIFT` per second: a growing
    queue that delays all samples looks like a slower clock of the vehicle.

    Attributes:
        known: whether the delay is known.
        seconds: the delay, s; 0 while it is not known.
        why_unknown: why the delay is not known; without meaning while it is known.
    """

    def __init__(self) -> None:
        self.known = False
        self.seconds = 0.0
        self.why_unknown = DelayUnknown.UNANSWERED
        self._exchanges: deque[_Exchange] = deque()
        self._last_implausible: _Exchange | None = None

    def take_exchange(self, now: float, error: float, delay: float) -> float | None:
        """Take an exchange, and store it if its delay is plausible.

        A single implausible delay is ignored. Two implausible delays in a row that agree show that
        a clock changed. If exchanges are stored and the new delay is negative, TIMESYNC has fallen
        behind the samples' stamps, and the caller must find out why. Otherwise TIMESYNC uses
        another clock, and all exchanges are forgotten.

        Args:
            now: event-loop time, s.
            error: largest error of `delay`, s: half the round trip, and the clock's drift since the
                newest sample.
            delay: TIMESYNC's offset minus the quickest sample's, s.

        Returns:
            How far TIMESYNC has fallen behind the samples' stamps, s; None if it has not.
        """
        exchange = _Exchange(now, error, delay)
        if -(error + _MAX_TIMESYNC_LAG) <= delay <= _MAX_DELAY:
            self._last_implausible = None
            self.why_unknown = DelayUnknown.UNANSWERED
            self._exchanges.append(exchange)
            self.expire(now)
            return None
        previous, self._last_implausible = self._last_implausible, exchange
        if previous is None:
            return None
        if abs(previous.delay - delay) > previous.initial_error + error + _MAX_TIMESYNC_LAG:
            return None
        self._last_implausible = None
        if self._exchanges and delay < 0.0:
            return self.seconds - delay
        self.forget(DelayUnknown.OTHER_CLOCK)
        return None

    def largest_possible(self, before: float) -> float:
        """The largest delay that the exchanges up to event-loop time `before` (s) allow, s.

        The result is 0 if there was no exchange up to `before`.
        """
        earlier_exchanges = [each for each in self._exchanges if each.answered_at <= before]
        if not earlier_exchanges:
            return 0.0
        best_exchange = min(earlier_exchanges, key=lambda each: each.error(before))
        return best_exchange.delay + best_exchange.error(before)

    def shorten(self, decrease: float, now: float) -> None:
        """Shorten all delays, because a sample came that was quicker than the quickest so far.

        Args:
            decrease: how much quicker the new sample was than the quickest so far, s.
            now: event-loop time, s.
        """
        self._exchanges = deque(
            each._replace(delay=each.delay - decrease) for each in self._exchanges
        )
        self.expire(now)

    def forget_after(self, since: float) -> None:
        """Forget the exchanges after event-loop time `since` (s): the clock may have changed."""
        while self._exchanges and self._exchanges[-1].answered_at > since:
            self._exchanges.pop()
        self.expire(since)

    def forget(self, reason: DelayUnknown) -> None:
        """Forget all exchanges: the delay is not known any more, because of `reason`."""
        self._exchanges.clear()
        self.known, self.why_unknown = False, reason
        self.seconds = 0.0

    def expire(self, now: float) -> None:
        """Forget exchanges too old at event-loop time `now` (s); use the best of the others."""
        exchanges = self._exchanges
        while exchanges and now - exchanges[0].answered_at > EXCHANGE_LIFETIME:
            exchanges.popleft()
        if not exchanges:
            self.forget(self.why_unknown)
            return
        self.known = True
        best_exchange = min(exchanges, key=lambda each: each.error(now))
        self.seconds = max(0.0, best_exchange.delay)
