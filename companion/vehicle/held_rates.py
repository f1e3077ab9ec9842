"""How long the vehicle holds each of our setpoints: what the rate of our answers really is."""

_UNEVEN = 2.0
"""A setpoint is held for half an interval on average; where intervals are so uneven that it is held
for as long as at half the rate, the rate counts as lower."""


class HeldRates:
    """Sums over the intervals between answers, without gaps.

    Attributes:
        intervals: How many.
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

        Samples that come in bursts are no better than the pauses between them: intervals g count
        as a rate of Σg/Σg² at most, twice over.
        """
        intervals = self.intervals - before.intervals
        seconds, squares = self.seconds - before.seconds, self.squares - before.squares
        if seconds <= 0.0 or squares <= 0.0:
            return None
        return min(intervals / seconds, _UNEVEN * seconds / squares)
