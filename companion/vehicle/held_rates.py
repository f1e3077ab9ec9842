"""The effective rate of our setpoints, from how long the vehicle holds each of them."""

_UNEVEN = 2.0
"""Uneven intervals hold setpoints longer on average than even ones. If they hold them longer than
even intervals of half the rate would, the rate counts as lower."""


class HeldRates:
    """Sums over the intervals between consecutive answers.

    Attributes:
        intervals: Their number.
        seconds: Their sum.
        squares: Sum of their squares, s².
    """

    __slots__ = ("intervals", "seconds", "squares")

    def __init__(self, intervals: int = 0, seconds: float = 0.0, squares: float = 0.0) -> None:
        self.intervals, self.seconds, self.squares = intervals, seconds, squares

    def add(self, interval: float) -> None:
        """Take the time between two answers, s."""
        self.intervals += 1
        self.seconds += interval
        self.squares += interval * interval

    def copy(self) -> "HeldRates":
        """These sums at this moment."""
        return HeldRates(self.intervals, self.seconds, self.squares)

    def rate_since(self, before: "HeldRates") -> float | None:
        """Answers a second since `before`, Hz, or None where nothing was answered in a row.

        Samples in bursts are worth no more than the pauses between them: for intervals g the rate
        is at most 2·Σg/Σg².
        """
        intervals = self.intervals - before.intervals
        seconds, squares = self.seconds - before.seconds, self.squares - before.squares
        if seconds <= 0.0 or squares <= 0.0:
            return None
        return min(intervals / seconds, _UNEVEN * seconds / squares)
