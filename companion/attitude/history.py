"""Where a plan stood a while ago, and where it goes on to."""

from collections import deque
from typing import NamedTuple


class Planned(NamedTuple):
    """The plan at one time.

    Attributes:
        time: s.
        north, east: coefficients.
        heading: rad, not wrapped.
        still: integral of R_z, the yaw rate that kept the heading still on the way, rad.
    """

    time: float
    north: float
    east: float
    heading: float
    still: float


class History:
    """What was planned, over the longest delay that is asked for."""

    __slots__ = ("_rows", "_span")

    def __init__(self, span: float) -> None:
        self._span = span
        self._rows: deque[Planned] = deque()

    def start(self, row: Planned, motion: Planned) -> None:
        """Forget all; up to `row` the plan moved evenly, by `motion` a second."""
        self._rows.clear()
        self._rows.append(Planned(*(a - self._span * b for a, b in zip(row, motion, strict=True))))
        self._rows.append(row)

    def add(self, row: Planned) -> None:
        """A newer row; rows that no delay reaches are dropped."""
        rows = self._rows
        rows.append(row)
        oldest = row.time - self._span
        while len(rows) > 2 and rows[1].time <= oldest:
            rows.popleft()

    @property
    def newest(self) -> Planned:
        """The plan as it was last added."""
        return self._rows[-1]

    def at(self, time: float) -> Planned:
        """The plan at `time`: linear between rows and beyond the newest, constant before all."""
        later = self._rows[-1]
        if time >= later.time:
            return _between(self._rows[-2], later, time)
        for row in reversed(self._rows):
            if row.time <= time:
                return row if row is later else _between(row, later, time)
            later = row
        return later


def _between(a: Planned, b: Planned, time: float) -> Planned:
    share = (time - a.time) / (b.time - a.time)
    return Planned(
        time,
        a.north + share * (b.north - a.north),
        a.east + share * (b.east - a.east),
        a.heading + share * (b.heading - a.heading),
        a.still + share * (b.still - a.still),
    )
