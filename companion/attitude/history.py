"""Where a reference stood a while ago."""

from collections import deque

Row = tuple[float, float, float, float]
"""(time in s, north, east, heading in rad, unwrapped)."""


class History:
    """The last rows of a reference, over the longest delay that is asked for."""

    __slots__ = ("_rows", "_span")

    def __init__(self, span: float) -> None:
        self._span = span
        self._rows: deque[Row] = deque()

    def start(self, row: Row) -> None:
        """Forget all; before `row` the reference stood where it says."""
        self._rows.clear()
        self._rows.append(row)

    def add(self, row: Row) -> None:
        """A newer row; rows that no delay reaches are dropped."""
        rows = self._rows
        rows.append(row)
        oldest = row[0] - self._span
        while len(rows) > 1 and rows[1][0] <= oldest:
            rows.popleft()

    def at(self, time: float) -> tuple[float, float, float]:
        """(north, east, heading) at `time`, linear between rows, constant beyond either end."""
        later = self._rows[-1]
        if time >= later[0]:
            return later[1:]
        for row in reversed(self._rows):
            if row[0] <= time:
                share = (time - row[0]) / (later[0] - row[0])
                return (
                    row[1] + share * (later[1] - row[1]),
                    row[2] + share * (later[2] - row[2]),
                    row[3] + share * (later[3] - row[3]),
                )
            later = row
        return later[1:]
