"""A curve with a time law along it, and the times at which to check it against limits.

Where the rate of the time law is constant, all laps of a figure are alike. So only the first and
the last lap are checked; they contain a helix's lowest and highest point. All ramps are checked.
Neighbouring check times are so close in phase and path length that an extreme between them is
missed by less than 0.3 % (an extreme of the jerk in a ramp shorter than 0.15 s by up to 1.8 %);
`tests/trajectory/test_check_times.py` compares them with a finer grid.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from math import atan2, ceil, remainder, tau
from typing import Protocol

import numpy as np

from companion.guidance.trajectory.curves import Curve, CurvePoint, PhaseSampling, require_checkable
from companion.guidance.trajectory.sample import LONGEST_DURATION, Sample, TrajectoryError
from companion.guidance.trajectory.septic_spline import Floats
from companion.guidance.trajectory.time_laws import Piece, TimeLaw, derivatives

_FEWEST_CHECKS = (16, 256)
"""Fewest check times in a short and in a long piece of a time law whose rate changes."""
_CHECK_PERIOD = 0.005
"""Time between two checks of a short piece, s; much shorter than a vehicle's response."""

_TABLE_ROWS = (64, 2048)
"""Smallest and largest number of rows of the table (time, phase) from which the check times are
interpolated; check times need not be exact."""
_ROWS_PER_PHASE = 8


def check_times(
    sampling: PhaseSampling, law: TimeLaw, longest_duration: float = LONGEST_DURATION
) -> list[float]:
    """Times at which to check a curve with a time law, ascending, s.

    Raises:
        TrajectoryError: the trajectory lasts longer than `longest_duration`, or needs more than
            MOST_CHECKS check times.
    """
    require_duration(law.duration, longest_duration)
    checked_pieces = [
        part
        for piece in law.pieces()
        if piece.end > piece.begin
        for part in _checked_pieces(piece, sampling, law)
    ]
    pieces_with_phases = [
        (part, (law.at(part.begin).phase, law.at(part.end).phase)) for part in checked_pieces
    ]
    require_checkable(
        sum(
            _check_count(part, sampling, *phases_at_ends)
            for part, phases_at_ends in pieces_with_phases
        )
    )
    time_arrays = [
        _check_times_in(part, sampling, law, phases_at_ends)
        for part, phases_at_ends in pieces_with_phases
    ]
    times: list[float] = np.unique(np.concatenate(([0.0, law.duration], *time_arrays))).tolist()
    return times


def require_duration(seconds: float, longest: float = LONGEST_DURATION) -> None:
    """Check that a trajectory lasts at most `longest` seconds.

    Raises:
        TrajectoryError: the trajectory lasts longer.
    """
    if not seconds <= longest:
        raise TrajectoryError(
            f"it lasts {seconds:.4g} s, and {longest:.0f} s is the longest; make it shorter"
        )


def _checked_pieces(piece: Piece, sampling: PhaseSampling, law: TimeLaw) -> Iterator[Piece]:
    """The parts to check: the first and last lap of a long steady piece, else the whole piece."""
    if piece.is_steady and sampling.period is not None:
        lap_duration = sampling.period / law.at(piece.begin).first_derivative
        if piece.end - piece.begin > 2.0 * lap_duration:
            yield Piece(piece.begin, piece.begin + lap_duration, True)
            yield Piece(piece.end - lap_duration, piece.end, True)
            return
    yield piece


def _check_count(piece: Piece, sampling: PhaseSampling, begin: float, end: float) -> float:
    if sampling.phase_step is None:
        return bisect_right(sampling.phases, end) - bisect_left(sampling.phases, begin)
    return (end - begin) / sampling.phase_step + _fewest_checks(piece)


def _fewest_checks(piece: Piece) -> int:
    if piece.is_steady:
        return 1
    return int(np.clip(ceil((piece.end - piece.begin) / _CHECK_PERIOD), *_FEWEST_CHECKS))


def _check_times_in(
    piece: Piece, sampling: PhaseSampling, law: TimeLaw, phases_at_ends: tuple[float, float]
) -> Floats:
    """The check times in a piece, both ends included."""
    begin, end = phases_at_ends
    if sampling.phase_step is None:
        phases = np.array(sampling.phases)
        phases = phases[(phases >= begin) & (phases <= end)]
    else:
        phases = np.linspace(begin, end, int(np.ceil((end - begin) / sampling.phase_step)) + 1)
    if piece.is_steady:
        rate = law.at(piece.begin).first_derivative
        ends = np.array([piece.begin, piece.end])
        return np.concatenate((ends, piece.begin + (phases - begin) / rate))
    row_count = int(np.clip(_ROWS_PER_PHASE * len(phases), *_TABLE_ROWS))
    table_times = np.linspace(piece.begin, piece.end, row_count)
    table_phases = np.array([law.at(time).phase for time in table_times.tolist()])
    even_times = np.linspace(piece.begin, piece.end, _fewest_checks(piece) + 1)
    # The jerk may jump at the end, and belongs to the next part there.
    before_end = np.nextafter(piece.end, piece.begin)
    phase_times = np.interp(phases, table_phases, table_times)
    return np.concatenate((even_times, [before_end], phase_times))


class Heading(Protocol):
    """Heading along a curve."""

    def at(self, phase: float, point: CurvePoint) -> tuple[float, float]:
        """Heading in rad, and its derivative by the phase, at a point of the curve."""


class HeldHeading:
    """Keeps the heading that the vehicle has at the start."""

    def at(self, phase: float, point: CurvePoint) -> tuple[float, float]:
        """(0, 0): the heading counts from the heading at the start, and does not change."""
        return 0.0, 0.0


@dataclass(frozen=True, slots=True)
class FixedHeading:
    """Keeps a given heading.

    Attributes:
        heading: heading, rad from north.
    """

    heading: float

    def at(self, phase: float, point: CurvePoint) -> tuple[float, float]:
        """The heading, which does not change."""
        return self.heading, 0.0


@dataclass(frozen=True, slots=True)
class TangentHeading:
    """Faces along the curve, whose first derivative must never be vertical or zero.

    Attributes:
        middle: centre of the heading's range, rad. The heading stays within π of it and so does not
            jump.
        winding: change of `middle` per unit of phase, rad.
    """

    middle: float
    winding: float = 0.0

    def at(self, phase: float, point: CurvePoint) -> tuple[float, float]:
        """Heading of the tangent, and its derivative by the phase."""
        (north, east, _), (north2, east2, _) = point.first_derivative, point.second_derivative
        slope = (north * east2 - east * north2) / (north * north + east * east)
        middle = self.middle + self.winding * phase
        return middle + remainder(atan2(east, north) - middle, tau), slope


@dataclass(frozen=True, slots=True)
class TimedCurve:
    """A trajectory: a curve, a time law along it and a heading.

    Attributes:
        name: name for messages.
        curve: the path.
        law: progress along the path over time.
        heading: heading along the path.
        longest_duration: longest duration that `check_times` allows, s.
    """

    name: str
    curve: Curve
    law: TimeLaw
    heading: Heading
    longest_duration: float = LONGEST_DURATION

    @property
    def duration(self) -> float:
        """Duration, s."""
        return self.law.duration

    @property
    def holds_heading(self) -> bool:
        """Whether the vehicle keeps the heading that it has at the start."""
        return isinstance(self.heading, HeldHeading)

    def check_times(self) -> list[float]:
        """Times at which to check the trajectory, s; see `Trajectory.check_times`."""
        return check_times(self.curve.sampling(), self.law, self.longest_duration)

    def at(self, time: float) -> Sample:
        """The sample `time` seconds after the beginning."""
        progress = self.law.at(time)
        point = self.curve.at(progress.phase)
        velocity, acceleration, jerk = derivatives(progress, *point[1:])
        heading, slope = self.heading.at(progress.phase, point)
        return Sample(
            point.position, velocity, acceleration, jerk, heading, slope * progress.first_derivative
        )
