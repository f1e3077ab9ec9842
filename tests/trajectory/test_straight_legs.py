"""Straight legs: on the lines between the points, at rest at each, as fast as the limits allow."""

from itertools import pairwise
from math import radians

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.guidance.trajectory import TrajectoryError, line, straight_legs, waypoints
from companion.guidance.trajectory.waypoints import largest_detour
from tests.trajectory.finite_differences import assert_rests_at_both_ends, largest

BOX = [(6.0, 0.0, 0.0), (6.0, 4.0, -2.0), (0.0, 4.0, -2.0), (0.0, 0.0, 0.0)]
LIMITS = 3.0, 2.5, 8.0

_points = st.lists(
    st.tuples(st.integers(-40, 40), st.integers(-40, 40), st.integers(-10, 10)),
    min_size=1,
    max_size=6,
    unique=True,
).map(lambda ps: [(0.5 * n, 0.5 * e, 0.5 * d) for n, e, d in ps if (n, e, d) != (0, 0, 0)])


def _off_the_lines(places, points):
    """Distance of each place from the nearest of the lines between the points."""
    corners = np.array([(0.0, 0.0, 0.0), *points])
    distances = []
    for begin, end in pairwise(corners):
        way = end - begin
        share = np.clip((places - begin) @ way / (way @ way), 0.0, 1.0)
        distances.append(np.linalg.norm(places - begin - share[:, None] * way, axis=1))
    return np.min(distances, axis=0)


@settings(max_examples=40)
@given(_points.filter(bool), st.floats(0.5, 8.0), st.floats(0.5, 8.0), st.floats(1.0, 20.0))
def test_it_stays_on_the_lines_and_within_the_limits(points, speed, acceleration, jerk):
    path = straight_legs(points, speed, acceleration, jerk)
    places = np.array([path.at(t).position for t in path.check_times()])
    assert _off_the_lines(places, points).max() < 1e-9
    assert_rests_at_both_ends(path)
    assert path.at(path.duration).position == pytest.approx(points[-1], abs=1e-9)
    found = np.array(largest(path, "velocity", "acceleration", "jerk", count=2001))
    assert (found <= np.multiply((speed, acceleration, jerk), 1.0 + 1e-9)).all()


def test_it_rests_at_every_point_and_moves_smoothly_between_them():
    path = straight_legs(BOX, *LIMITS)
    times = np.linspace(0.0, path.duration, 40_001)
    samples = [path.at(t) for t in times.tolist()]
    places, speeds = (np.array([one[k] for one in samples]) for k in (0, 1))
    for point in BOX:
        near = np.linalg.norm(places - point, axis=1)
        near[:100] = np.inf  # the last is where it began
        assert near.min() < 1e-3
        assert np.linalg.norm(speeds[near.argmin()]) < 0.01
    step = times[1]
    assert np.gradient(places, step, axis=0)[1:-1] == pytest.approx(speeds[1:-1], abs=2.0 * step)
    assert np.abs(np.diff(speeds, axis=0)).max() <= LIMITS[1] * step * (1.0 + 1e-6)


def test_each_leg_is_the_line_that_flies_there():
    path = straight_legs(BOX, *LIMITS)
    first, second = line(BOX[0], *LIMITS), line((0.0, 4.0, -2.0), *LIMITS)
    for t in np.linspace(0.0, first.duration, 50)[:-1]:
        assert path.at(t) == first.at(t)
    for t in np.linspace(0.0, second.duration, 50)[:-1]:
        assert path.at(first.duration + t)[1] == pytest.approx(second.at(t).velocity, abs=1e-9)


def test_headings_are_reached_at_their_points():
    path = straight_legs(BOX, *LIMITS, headings=[None, radians(90.0), None, radians(-170.0)])
    assert not path.holds_heading
    ends = np.cumsum([line(way, *LIMITS).duration for way in np.diff([(0, 0, 0), *BOX], axis=0)])
    assert path.at(ends[1]).heading == pytest.approx(radians(90.0))
    assert path.at(ends[3]).heading == pytest.approx(radians(190.0))  # the short way round
    assert path.at(ends[1]).heading_rate == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(
    ("points", "limits", "headings", "message"),
    [
        ([], LIMITS, (), "there are no waypoints"),
        ([BOX[0], BOX[0]], LIMITS, (), "waypoint 2 is the same as waypoint 1"),
        ([(0.0, 0.0, 0.0)], LIMITS, (), "waypoint 1 is the same as the start"),
        (BOX, (0.0, 1.0, 1.0), (), "must be positive"),
        (BOX, LIMITS, (0.0,), "there are 1 headings for 4 waypoints"),
    ],
)
def test_what_cannot_be_flown_is_refused(points, limits, headings, message):
    with pytest.raises(TrajectoryError, match=message):
        straight_legs(points, *limits, headings=headings)


def test_the_detour_of_the_smooth_curve_is_told_as_it_is():
    path = waypoints(BOX, 3.0, 3.0)
    places = np.array([path.at(t).position for t in np.linspace(0.0, path.duration, 5001)])
    detour = largest_detour(path.curve.spline)
    assert detour == pytest.approx(_off_the_lines(places, BOX).max(), abs=0.02)
    assert largest_detour(waypoints([(5.0, 0.0, 0.0)], 3.0, 3.0).curve.spline) < 1e-9
