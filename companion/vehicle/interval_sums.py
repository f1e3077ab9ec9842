"""The effective rate of setpoints or samples, from the intervals between them."""

_MAX_INTERVAL_RATIO = 2.0
"""Largest ratio of Σg²/Σg to the mean interval at which the effective rate is the mean rate.

g are the intervals. The ratio is 1 for equal intervals. Above the limit, the effective rate is
lower than the mean rate.
"""


class IntervalSums:
    """Sums over the intervals between consecutive setpoints or samples.

    Attributes:
        count: number of intervals.
        total: sum of the intervals, s.
        sum_of_squares: sum of the squared intervals, s².
    """

    __slots__ = ("count", "sum_of_squares", "total")

    def __init__(self, count: int = 0, total: float = 0.0, sum_of_squares: float = 0.0) -> None:
        self.count, self.total, self.sum_of_squares = count, total, sum_of_squares

    def add(self, interval: float) -> None:
        """Add the interval between two consecutive setpoints or samples, s."""
        self.count += 1
        self.total += interval
        self.sum_of_squares += interval * interval

    def copy(self) -> "IntervalSums":
        """A copy of the present sums."""
        return IntervalSums(self.count, self.total, self.sum_of_squares)

    def rate_since(self, earlier: "IntervalSums") -> float | None:
        """Effective rate since `earlier`, Hz; None if there was no interval since then.

        The rate is the number of intervals per second, but at most 2·Σg/Σg² of the intervals g.
        Long intervals dominate Σg², so pauses between bursts lower the rate.
        """
        count = self.count - earlier.count
        total = self.total - earlier.total
        sum_of_squares = self.sum_of_squares - earlier.sum_of_squares
        if total <= 0.0 or sum_of_squares <= 0.0:
            return None
        return min(count / total, _MAX_INTERVAL_RATIO * total / sum_of_squares)
