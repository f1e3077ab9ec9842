"""The steps of a flight, taken apart where it paused between them."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from companion.attitude import coefficients

Floats = NDArray[np.float64]

_GAP = 0.5
"""Rows further apart than this belong to different runs, s."""
_FEWEST = 10


class StepRun(NamedTuple):
    """Steps flown without a pause between them, as a doublet is.

    Attributes:
        time: (n,), vehicle time, s, rising.
        measured: (n, 2), coefficients north and east.
        target: (n, 2), those asked for in answer to the sample of that row.
    """

    time: Floats
    measured: Floats
    target: Floats

    def steps(self) -> list["StepRun"]:
        """Each step by itself: from one change of the target to the next."""
        return [StepRun(*parts) for parts in zip(*self._split(), strict=True)]

    def _split(self) -> list[list[Floats]]:
        changes = np.flatnonzero(np.any(np.diff(self.target, axis=0), axis=1)) + 1
        return [np.split(column, changes) for column in self]


def step_runs(rows: Floats) -> list[StepRun]:
    """The runs in rows (N, 7) of `FlightTrace.response`, but those too short to tell anything."""
    if len(rows) == 0:
        return []
    parts = np.split(rows, np.flatnonzero(np.diff(rows[:, 0]) > _GAP) + 1)
    return [
        StepRun(
            part[:, 0],
            np.array([coefficients(tuple(row[1:5])) for row in part]),
            part[:, 5:7],
        )
        for part in parts
        if len(part) > _FEWEST
    ]
