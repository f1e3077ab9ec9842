"""The effective rate of setpoints or samples, from the intervals between them."""

_MAX_INTERVAL_RATIO = 2.0
"""Largest ratio of Σg²/Σg to the mean interval at which the effective rate is the mean rate.

g are the intervals. The ratio is 1 for equal intervals. Above the limit, the effective rate is
lower than the mean rate.
"""


class IntervalSums:
    """Sums over the intervals between consecutive setpoints or samples.

    Attributes:
        intervals: number of intervals.
        seconds: sum of the intervals, s.
        squares: sum of the squared intervals, s².
    """

    __slots__ = ("intervals", "seconds", "squares")

    def __init__(self, intervals: int = 0, seconds: float = 0.0, squares: float = 0.0) -> None:
        self.intervals, self.seconds, self.squares = intervals, seconds, squares

    def add(self, interval: float) -> None:
        """Add the interval between two consecutive setpoints or samples, s."""
        self.intervals += 1
        self.seconds += interval
        self.squares += interval * interval

    def copy(self) -> "IntervalSums":
        """A copy of the present sums."""
        return IntervalSums(self.intervals, self.seconds, self.squares)

    def rate_since(self, earlier: "IntervalSums") -> float | None:
        """Effective rate since `earlier`, Hz; None if there was no interval since then.

        The rate is the number of intervals per second, but at most 2·Σg/Σg² of the intervals g.
        Long intervals dominate Σg², so pauses between bursts lower the rate.
        """
        intervals = self.intervals - earlier.intervals
        seconds, squares = self.seconds - earlier.seconds, self.squares - earlier.squares
        if seconds <= 0.0 or squares <= 0.0:
            return None
        return min(intervals / seconds, _MAX_INTERVAL_RATIO * seconds / squares)
