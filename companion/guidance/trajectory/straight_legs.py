"""Straight legs between waypoints, with a stop at each of them."""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from companion.guidance.trajectory.curves import PATH_STEP, CurvePoint, PhaseSampling
from companion.guidance.trajectory.sample import Vector
from companion.guidance.trajectory.time_laws import LimitedJerk, Piece, Progress
from companion.guidance.trajectory.timed_curve import Heading, HeldHeading, TimedCurve
from companion.guidance.trajectory.waypoints import given_headings, places_of

_NONE = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Polyline:
    """Straight lines from point to point. Its phase is the distance along them, m.

    The direction jumps at the points, so the time law must be at rest there.

    Attributes:
        ends: phase at the end of each leg, ascending, m.
        starts: the point where each leg begins, NED, m.
        directions: unit vector of each leg, NED.
    """

    ends: tuple[float, ...]
    starts: tuple[Vector, ...]
    directions: tuple[Vector, ...]

    def sampling(self) -> PhaseSampling:
        """The phases at which to check it: at equal distances."""
        return PhaseSampling(PATH_STEP)

    def at(self, phase: float) -> CurvePoint:
        """The point `phase` metres along."""
        leg = min(bisect_right(self.ends, phase), len(self.ends) - 1)
        along = phase - (self.ends[leg - 1] if leg else 0.0)
        (n, e, d), (north, east, down) = self.starts[leg], self.directions[leg]
        place = n + along * north, e + along * east, d + along * down
        return CurvePoint(place, self.directions[leg], _NONE, _NONE)


class Legs:
    """One leg after another, each from rest to rest in pieces of constant jerk."""

    def __init__(self, legs: Sequence[LimitedJerk], lengths: Sequence[float]) -> None:
        """Join the legs.

        Args:
            legs: the time law of each leg.
            lengths: their lengths, m.
        """
        self._legs = legs
        self._ends = np.cumsum([leg.duration for leg in legs]).tolist()
        self._phases = np.cumsum([0.0, *lengths]).tolist()
        self.duration: float = self._ends[-1]

    def pieces(self) -> list[Piece]:
        """The pieces of all legs."""
        begins = [0.0, *self._ends]
        return [
            Piece(begin + piece.begin, begin + piece.end, piece.steady)
            for begin, leg in zip(begins, self._legs, strict=False)
            for piece in leg.pieces()
        ]

    def at(self, time: float) -> Progress:
        """Progress at `time`: the distance along all legs, m."""
        leg = min(bisect_right(self._ends, time), len(self._legs) - 1)
        progress = self._legs[leg].at(time - (self._ends[leg - 1] if leg else 0.0))
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
        headings: heading at each point, rad from north, or None for any. The vehicle turns on the
            way, the short way round. Empty: it holds its heading.

    Raises:
        TrajectoryError: there are no points, two consecutive points are equal, a limit is not
            positive, or the number of headings is wrong.
    """
    places, lengths = places_of(points, headings)
    phases = np.concatenate(([0.0], np.cumsum(lengths)))
    legs = [LimitedJerk(length, speed, acceleration, jerk) for length in lengths.tolist()]
    directions = np.diff(places, axis=0) / lengths[:, None]
    curve = Polyline(tuple(phases[1:].tolist()), _vectors(places[:-1]), _vectors(directions))
    heading: Heading = HeldHeading()
    if any(angle is not None for angle in headings):
        heading = given_headings(phases, headings)
    return TimedCurve("straight legs", curve, Legs(legs, lengths.tolist()), heading)


def _vectors(rows: np.ndarray) -> tuple[Vector, ...]:
    return tuple((north, east, down) for north, east, down in rows.tolist())
