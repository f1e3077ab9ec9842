"""When to look at a trajectory so that no broken limit is missed, at a cost that is bounded.

Where the time law is steady, a figure is gone round the same way in each lap: the first lap and the
last one tell of all (a helix rises steadily, so it is highest and lowest in them). The ramps are
looked at whole. Two looks are so near in phase and in way that an extreme between them is missed by
less than 0.3 % of it; `tests/trajectory/test_check_times.py` holds them against a finer grid.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Iterator

import numpy as np

from companion.guidance.trajectory.curves import Looks, require_looks
from companion.guidance.trajectory.sample import LONGEST, TrajectoryError
from companion.guidance.trajectory.septic_spline import Floats
from companion.guidance.trajectory.time_laws import Piece, TimeLaw

_LOOKS_A_PIECE = 256
"""At least, in each smooth part of a time law whose rate changes."""

_TABLE = 2048
"""Places of the table that finds the time of a phase; it need not be exact."""


def check_times(looks: Looks, law: TimeLaw) -> list[float]:
    """The times at which to look at a curve that is run through by a time law, ascending, s.

    Raises:
        TrajectoryError: it lasts longer than `LONGEST`, or takes more than MOST_LOOKS.
    """
    require_duration(law.duration)
    parts = [
        part
        for piece in law.pieces()
        if piece.end > piece.begin
        for part in _told_apart(piece, looks, law)
    ]
    phases = [(law.at(part.begin).phase, law.at(part.end).phase) for part in parts]
    require_looks(sum(_count(looks, *span) for span in phases))
    grids = [_times(part, looks, law, span) for part, span in zip(parts, phases, strict=True)]
    times: list[float] = np.unique(np.concatenate(([0.0, law.duration], *grids))).tolist()
    return times


def require_duration(seconds: float) -> None:
    """See that a trajectory does not last too long.

    Raises:
        TrajectoryError: it does.
    """
    if not seconds <= LONGEST:
        raise TrajectoryError(f"it lasts {seconds:.4g} s, and {LONGEST:.0f} s is the longest")


def _told_apart(piece: Piece, looks: Looks, law: TimeLaw) -> Iterator[Piece]:
    """The piece, or its first lap and its last one if it is steady and has more."""
    if piece.steady and looks.period is not None:
        lap = looks.period / law.at(piece.begin).first
        if piece.end - piece.begin > 2.0 * lap:
            yield Piece(piece.begin, piece.begin + lap, True)
            yield Piece(piece.end - lap, piece.end, True)
            return
    yield piece


def _count(looks: Looks, begin: float, end: float) -> float:
    if looks.step is None:
        return bisect_right(looks.phases, end) - bisect_left(looks.phases, begin)
    return (end - begin) / looks.step + _LOOKS_A_PIECE


def _times(piece: Piece, looks: Looks, law: TimeLaw, span: tuple[float, float]) -> Floats:
    """The times of the looks in a piece, both ends among them."""
    begin, end = span
    if looks.step is None:
        phases = np.array(looks.phases)
        phases = phases[(phases >= begin) & (phases <= end)]
    else:
        phases = np.linspace(begin, end, int(np.ceil((end - begin) / looks.step)) + 1)
    if piece.steady:
        rate = law.at(piece.begin).first
        ends = np.array([piece.begin, piece.end])
        return np.concatenate((ends, piece.begin + (phases - begin) / rate))
    table = np.linspace(piece.begin, piece.end, _TABLE)
    reached = np.array([law.at(time).phase for time in table.tolist()])
    evenly = np.linspace(piece.begin, piece.end, _LOOKS_A_PIECE + 1)
    # The jerk may jump at the end, and belongs to the next part there.
    before = np.nextafter(piece.end, piece.begin)
    return np.concatenate((evenly, [before], np.interp(phases, reached, table)))
