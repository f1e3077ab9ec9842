"""Straight legs between waypoints, with a stop at each of them."""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate

import numpy as np

from companion.guidance.trajectory.curves import PATH_STEP, CurvePoint, PhaseSampling, Straight
from companion.guidance.trajectory.sample import Vector
from companion.guidance.trajectory.septic_spline import Floats
from companion.guidance.trajectory.time_laws import LimitedJerk, Piece, Progress
from companion.guidance.trajectory.timed_curve import TimedCurve
from companion.guidance.trajectory.waypoints import heading_through, positions_and_distances


@dataclass(frozen=True, slots=True)
class Polyline:
    """Straight lines from point to point. Its phase is the distance along them, m.

    The direction jumps at the points, so the time law must be at rest there.

    Attributes:
        begins: phase where each leg begins, ascending from 0, m.
        starts: the point where each leg begins, NED, m.
        legs: the legs, each as if it began at (0, 0, 0).
    """

    begins: tuple[float, ...]
    starts: tuple[Vector, ...]
    legs: tuple[Straight, ...]

    def sampling(self) -> PhaseSampling:
        """The phases at which to check the lines: at equal distances."""
        return PhaseSampling(PATH_STEP)

    def at(self, phase: float) -> CurvePoint:
        """The point at the distance `phase` (m) along the lines."""
        leg = _leg_at(phase, self.begins)
        point = self.legs[leg].at(phase - self.begins[leg])
        (n, e, d), (north, east, down) = self.starts[leg], point.position
        return point._replace(position=(n + north, e + east, d + down))


class Legs:
    """Time law of legs one after another, each from rest to rest in pieces of constant jerk."""

    def __init__(self, legs: Sequence[LimitedJerk], phases: Sequence[float]) -> None:
        """Join the time laws of the legs; `phases`: where each leg begins, m."""
        self._legs, self._phases = legs, phases
        *self._begins, self.duration = accumulate((leg.duration for leg in legs), initial=0.0)

    def pieces(self) -> list[Piece]:
        """The pieces of all legs."""
        return [
            Piece(begin + piece.begin, begin + piece.end, piece.is_steady)
            for begin, leg in zip(self._begins, self._legs, strict=True)
            for piece in leg.pieces()
        ]

    def at(self, time: float) -> Progress:
        """Progress at `time`: the distance along all legs, m."""
        leg = _leg_at(time, self._begins)
        progress = self._legs[leg].at(time - self._begins[leg])
        return progress._replace(phase=self._phases[leg] + progress.phase)


def straight_legs(
    points: Sequence[Vector],
    speed: float,
    acceleration: float,
    jerk: float,
    headings: Sequence[float | None] = (),
) -> TimedCurve:
    """Straight lines through all points with a stop at each, as fast as three limits allow.

    Args:
        points: (north, east, down) from the start, m, without the start itself.
        speed: largest speed, m/s.
        acceleration: largest acceleration, m/s².
        jerk: largest jerk, m/s³.
        headings: heading at each point, rad from north, or None for any. The vehicle turns during
            the legs, the short way round. Empty: the vehicle holds its heading.

    Raises:
        TrajectoryError: there are no points, two consecutive points are equal, a limit is not
            positive, or the number of headings is wrong.
    """
    positions, lengths = positions_and_distances(points, headings)
    phases = np.concatenate(([0.0], np.cumsum(lengths)))
    legs = [LimitedJerk(length, speed, acceleration, jerk) for length in lengths.tolist()]
    begins = tuple(phases[:-1].tolist())
    directions = _vectors(np.diff(positions, axis=0) / lengths[:, None])
    curve = Polyline(begins, _vectors(positions[:-1]), tuple(map(Straight, directions)))
    heading = heading_through(phases, headings)
    return TimedCurve("straight legs", curve, Legs(legs, begins), heading)


def _leg_at(value: float, begins: Sequence[float]) -> int:
    """Index of the leg at a phase or time; of the first leg before 0, of the last past the end."""
    return max(bisect_right(begins, value) - 1, 0)


def _vectors(rows: Floats) -> tuple[Vector, ...]:
    return tuple((north, east, down) for north, east, down in rows.tolist())
