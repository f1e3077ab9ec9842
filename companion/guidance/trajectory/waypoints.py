"""Waypoints joined by minimum snap, as fast as a speed and an acceleration allow."""

from collections.abc import Sequence
from math import inf

import numpy as np
from numpy.typing import NDArray

from companion.guidance.finite import finite_vector
from companion.guidance.trajectory.minimum_snap import FixedStates, minimum_snap
from companion.guidance.trajectory.sample import SMALLEST_DISTANCE, TrajectoryError, Vector
from companion.guidance.trajectory.septic_spline import STATE_SIZE, Floats, SepticSpline
from companion.guidance.trajectory.spline_curve import (
    HEADING_CHECK_STEP,
    SplineCurve,
    SplineHeading,
    tangent_heading,
)
from companion.guidance.trajectory.time_laws import Cruise
from companion.guidance.trajectory.timed_curve import (
    Heading,
    HeldHeading,
    TimedCurve,
    require_duration,
)

_SAMPLES_PER_SEGMENT = 200
"""Number of samples of a segment from which its largest speed and acceleration are found."""
_DETOUR_SAMPLES = 20
"""Number of samples of a segment from which its distance from a straight line is found."""
_SMALLEST_SQUARED_LENGTH = 1e-12
"""Lower bound of the squared length of a segment, m², so that equal points cause no 0/0."""


def waypoints(
    points: Sequence[Vector],
    speed: float,
    acceleration: float,
    face_path: bool = False,
    headings: Sequence[float | None] = (),
) -> TimedCurve:
    """A trajectory through all points without a stop, from rest at the start to rest at the last.

    The durations of the segments have the ratios of trapezoidal speed profiles from rest to rest.
    The whole trajectory is then scaled in time until it just meets one of the two limits.

    Args:
        points: (north, east, down) from the start, m, without the start itself.
        speed: largest speed, m/s.
        acceleration: largest acceleration, m/s².
        face_path: face along the path instead of holding the heading.
        headings: heading at each point, rad from north, or None for any. The vehicle turns the
            short way between headings. The spline of the headings gives the heading at the start.

    Raises:
        TrajectoryError: there are no points, two consecutive points are equal, a limit is not
            positive, the number of headings is wrong, `face_path` and `headings` are both given,
            all points are above each other and `face_path` is set, or the trajectory lasts too
            long.
    """
    if not (0.0 < speed < inf and 0.0 < acceleration < inf):
        raise TrajectoryError("speed and acceleration of waypoints must be positive")
    if face_path and headings:
        raise TrajectoryError("give waypoints their own headings or the heading along the path")
    positions, distances = positions_and_distances(points, headings)
    knots = np.concatenate(([0.0], np.cumsum(_trapezoid_durations(distances, speed, acceleration))))
    knots *= _stretch_factor(_spline_through(knots, positions), knots, speed, acceleration)
    require_duration(float(knots[-1]))
    spline = _spline_through(knots, positions)
    curve, heading = SplineCurve(spline), heading_through(knots, headings)
    if face_path:
        curve = SplineCurve(spline, longest_step=HEADING_CHECK_STEP)
        heading = tangent_heading(spline, (True, True))
    return TimedCurve("waypoints", curve, Cruise(spline.end, 1.0), heading)


def positions_and_distances(
    points: Sequence[Vector], headings: Sequence[float | None]
) -> tuple[Floats, Floats]:
    """The start and the points, (k + 1, 3), and the distances between them, (k,), m.

    Raises:
        TrajectoryError: there are no points, two consecutive points are equal, a point is not three
            finite numbers, or there are headings, but not one for each point.
    """
    if headings and len(headings) != len(points):
        raise TrajectoryError(
            f"there are {len(headings)} headings for {len(points)} waypoints; give one for each"
        )
    positions = np.array([(0.0, 0.0, 0.0), *map(_finite_point, points)])
    distances = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    if not distances.size or distances.min() < SMALLEST_DISTANCE:
        raise TrajectoryError(_distance_fault(distances))
    return positions, distances


def _finite_point(point: Vector) -> Vector:
    """A waypoint as three finite numbers.

    Raises:
        TrajectoryError: `point` is not three finite numbers.
    """
    try:
        return finite_vector("each waypoint", point)
    except ValueError as error:
        raise TrajectoryError(str(error)) from None


def _distance_fault(distances: Floats) -> str:
    if not distances.size:
        return "there are no waypoints"
    index = int(np.flatnonzero(distances < SMALLEST_DISTANCE)[0])
    earlier_point = f"waypoint {index}" if index else "the start"
    return f"waypoint {index + 1} is the same as {earlier_point}; leave it out"


def _trapezoid_durations(distances: Floats, speed: float, acceleration: float) -> Floats:
    """Duration of a trapezoidal speed profile from rest to rest over each distance, s."""
    with_cruise = distances / speed + speed / acceleration
    without_cruise = 2.0 * np.sqrt(distances / acceleration)
    return np.where(distances < speed**2 / acceleration, without_cruise, with_cruise)


def _spline_through(knots: Floats, positions: Floats) -> SepticSpline:
    """A spline through the places (k, n) at the knots, from rest to rest."""
    states = np.zeros((knots.size, STATE_SIZE, positions.shape[1]))
    states[:, 0] = positions
    return minimum_snap(
        knots, FixedStates(states, _rest_to_rest_mask(np.ones(knots.size, dtype=bool)))
    )


def _rest_to_rest_mask(values: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Mask (k, 4) of fixed states: each value where `values` (k,) is true; both ends at rest."""
    mask = np.zeros((values.size, STATE_SIZE), dtype=bool)
    mask[:, 0] = values
    mask[[0, -1], 1:] = True
    return mask


def _stretch_factor(
    spline: SepticSpline, knots: Floats, speed: float, acceleration: float
) -> float:
    """Factor that stretches the knots so that the spline just meets one of the two limits.

    A minimum-snap spline over knots stretched in time has the same path.
    """
    motion = _sampled(spline, knots)
    max_speed, max_acceleration = np.linalg.norm(motion[:, :, 1:3], axis=1).max(axis=0)
    return max(float(max_speed) / speed, float(np.sqrt(max_acceleration / acceleration)))


def _sampled(spline: SepticSpline, knots: Floats, count: int = _SAMPLES_PER_SEGMENT) -> Floats:
    """The spline along `count` evenly spaced times of each segment, and at the end."""
    fine = np.linspace(0.0, knots.size - 1.0, count * (knots.size - 1) + 1)
    return spline.sampled(np.interp(fine, np.arange(knots.size), knots))


def heading_through(knots: Floats, headings: Sequence[float | None]) -> Heading:
    """A spline through the given headings, turning the short way; without any the heading is held.

    Args:
        knots: phases of the start and of the points, (k + 1,).
        headings: heading at each point, rad, or None for any, (k,); empty: none is given.
    """
    if all(angle is None for angle in headings):
        return HeldHeading()
    is_given = np.array([angle is not None for angle in (None, *headings)])
    states = np.zeros((knots.size, STATE_SIZE, 1))
    states[is_given, 0, 0] = np.unwrap([angle for angle in headings if angle is not None])
    return SplineHeading(minimum_snap(knots, FixedStates(states, _rest_to_rest_mask(is_given))))


def largest_detour(spline: SepticSpline, times: Floats | None = None) -> float:
    """Largest distance of a spline from a polyline through some of its points, m.

    Args:
        spline: the spline.
        times: (k,), times of these points, increasing, s; None: the knots of the spline.
    """
    points = spline.knots if times is None else times
    path = _sampled(spline, points, _DETOUR_SAMPLES)[:, :, 0]
    lines = np.diff(path[::_DETOUR_SAMPLES], axis=0)[:, None]  # (k, 1, 3)
    offsets = path[:-1].reshape(len(lines), _DETOUR_SAMPLES, 3)
    offsets = offsets - offsets[:, :1]
    squared_lengths = np.maximum((lines * lines).sum(axis=2), _SMALLEST_SQUARED_LENGTH)
    fractions = np.clip((offsets * lines).sum(axis=2) / squared_lengths, 0.0, 1.0)
    return float(np.linalg.norm(offsets - fractions[..., None] * lines, axis=2).max())
