"""Where the thrust pointed lately, so that motion is set against the thrust that made it."""

from bisect import bisect_right
from collections import deque
from itertools import islice

from companion.guidance.horizontal import Horizontal

_KEPT = 200
"""Attitudes: 0.8 s of them at 250 Hz, and more than any position takes to come."""


class SlopeHistory:
    """Horizontal per vertical thrust over vehicle time, as its running integral.

    Positions come late, seldom, and not in step with guidance: what happened between two of them is
    told by their own time stamps, not by when they were looked at.
    """

    def __init__(self) -> None:
        self._times: deque[float] = deque(maxlen=_KEPT)
        self._sums: deque[Horizontal] = deque(maxlen=_KEPT)
        self.newest: Horizontal = (0.0, 0.0)

    def add(self, time: float, slope: Horizontal) -> None:
        """Take the slope of an attitude; one that is not newer than the last starts anew.

        Args:
            time: vehicle time, s.
            slope: north and east, no unit.
        """
        if not self._times or time <= self._times[-1]:
            self._times.clear()
            self._sums.clear()
            self._times.append(time)
            self._sums.append((0.0, 0.0))
        else:
            dt = time - self._times[-1]
            north, east = self._sums[-1]
            before = self.newest
            self._times.append(time)
            self._sums.append(
                (
                    north + 0.5 * dt * (before[0] + slope[0]),
                    east + 0.5 * dt * (before[1] + slope[1]),
                )
            )
        self.newest = slope

    def forget(self) -> None:
        """Start anew: the attitudes before are seen from another north."""
        self._times.clear()
        self._sums.clear()

    def mean(self, start: float, end: float) -> Horizontal:
        """The mean slope between two vehicle times, s; before and after what is known, as there."""
        if not start < end or not self._times:
            return self.newest
        (n0, e0), (n1, e1) = self._integral(start), self._integral(end)
        return (n1 - n0) / (end - start), (e1 - e0) / (end - start)

    def _integral(self, time: float) -> Horizontal:
        """Up to `time`, between and beyond the attitudes along the straight line."""
        times, sums = self._times, self._sums
        if time >= times[-1]:
            after = time - times[-1]
            north, east = sums[-1]
            return north + after * self.newest[0], east + after * self.newest[1]
        if len(times) == 1:
            return sums[0]
        index = min(max(1, bisect_right(times, time)), len(times) - 1)
        t0, t1 = islice(times, index - 1, index + 1)
        (n0, e0), (n1, e1) = islice(sums, index - 1, index + 1)
        share = (time - t0) / (t1 - t0)
        return n0 + share * (n1 - n0), e0 + share * (e1 - e0)
