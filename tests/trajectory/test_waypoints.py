"""Waypoints: met without a stop, within the limits, facing where they should."""

from math import atan2, hypot, pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.guidance.trajectory import TrajectoryError, waypoints
from tests.trajectory.finite_differences import (
    assert_derivatives_agree,
    assert_rests_at_both_ends,
    inner_times,
    largest,
)

SQUARE = [(6.0, 0.0, 0.0), (6.0, 6.0, -1.0), (0.0, 6.0, -1.0), (0.0, 0.0, 0.0)]

# Not nearer to each other than 0.5 m, nor in a vertical line.
_points = st.lists(
    st.tuples(st.integers(-40, 40), st.integers(-40, 40), st.integers(-10, 10)),
    min_size=1,
    max_size=6,
    unique_by=lambda p: p[:2],
).map(lambda ps: [(0.5 * n, 0.5 * e, 0.5 * d) for n, e, d in ps if (n, e) != (0, 0)])


def _passes(trajectory):
    """When it is nearest to each point of SQUARE, and how near."""
    times = np.linspace(0.0, trajectory.duration, 20_001)
    places = np.array([trajectory.at(t).position for t in times.tolist()])
    distances = np.linalg.norm(places[:, None] - np.array(SQUARE), axis=2)
    distances[:2000, -1] = np.inf  # the last is where it began
    return times[distances.argmin(axis=0)], distances.min(axis=0)


@settings(max_examples=25)
@given(_points.filter(bool), st.floats(0.5, 8.0), st.floats(0.5, 8.0), st.booleans())
def test_derivatives_agree_and_the_limits_are_met(points, speed, acceleration, along):
    path = waypoints(points, speed, acceleration, along)
    assert_derivatives_agree(path, inner_times(path))
    assert_rests_at_both_ends(path)
    assert path.at(path.duration).position == pytest.approx(points[-1], abs=1e-9)
    fastest, strongest = largest(path, "velocity", "acceleration", count=2001)
    assert max(fastest / speed, strongest / acceleration) == pytest.approx(1.0, rel=1e-3)


def test_all_points_are_passed_in_their_order_and_none_is_a_stop():
    path = waypoints(SQUARE, 3.0, 4.0)
    times, distances = _passes(path)
    assert distances == pytest.approx([0.0] * 4, abs=2e-3)
    assert (np.diff(times) > 1.0).all()
    for t in times[:-1]:
        assert hypot(*path.at(t).velocity) > 1.0


def test_a_long_way_takes_its_share_of_the_time():
    path = waypoints([(2.0, 0.0, 0.0), (40.0, 0.0, 0.0)], 4.0, 3.0)
    times = np.linspace(0.0, path.duration, 5001)
    norths = [path.at(t).position[0] for t in times]
    reached = times[np.searchsorted(norths, 2.0)]
    # Trapezoids from rest to rest: 2√(2/3) s, and 38/4 + 4/3 s.
    first, second = 2.0 * (2.0 / 3.0) ** 0.5, 38.0 / 4.0 + 4.0 / 3.0
    assert reached / path.duration == pytest.approx(first / (first + second), rel=1e-2)


def test_the_way_does_not_depend_on_how_fast_it_is_flown():
    slow, fast = waypoints(SQUARE, 1.0, 1e3), waypoints(SQUARE, 4.0, 1e3)
    assert slow.duration == pytest.approx(4.0 * fast.duration, rel=1e-2)


def test_facing_along_the_path():
    path = waypoints(SQUARE, 3.0, 4.0, face_path=True)
    assert not path.holds_heading
    for t in np.linspace(0.2, 0.8, 50) * path.duration:
        sample = path.at(t)
        along = atan2(sample.velocity[1], sample.velocity[0])
        assert np.cos(along - sample.heading) > np.cos(np.radians(3.0))


def test_given_headings_are_met_where_they_are_given_and_turned_to_the_short_way():
    path = waypoints(SQUARE, 3.0, 4.0, headings=[None, 3.0, -3.0, None])
    times, _ = _passes(path)
    assert path.at(times[1]).heading == pytest.approx(3.0, abs=0.02)
    assert path.at(times[2]).heading == pytest.approx(2.0 * pi - 3.0, abs=0.02)
    assert_derivatives_agree(path, inner_times(path))
    assert_rests_at_both_ends(path)


def test_one_heading_is_held_all_the_way():
    path = waypoints(SQUARE, 3.0, 4.0, headings=[None, 1.2, None, None])
    assert [path.at(t).heading for t in inner_times(path, 20)] == pytest.approx([1.2] * 20)
    assert not path.holds_heading


def test_no_heading_at_all_is_the_one_at_the_start():
    assert waypoints(SQUARE, 3.0, 4.0, headings=[None] * 4).holds_heading


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (([], 1.0, 1.0), "no waypoints"),
        (([(0.0, 0.0, 0.0)], 1.0, 1.0), "waypoint 1 is the same as the start"),
        (([(1.0, 0.0, 0.0)] * 2, 1.0, 1.0), "waypoint 2 is the same as waypoint 1"),
        ((SQUARE, 1.0, 0.0), "must be positive"),
        ((SQUARE, 1.0, 1.0, True, [0.0] * 4), "their own headings or the heading along"),
        ((SQUARE, 1.0, 1.0, False, [0.0] * 3), "3 headings for 4 waypoints"),
        (([(0.0, 0.0, -3.0)], 1.0, 1.0, True), "never moves horizontally"),
    ],
)
def test_what_cannot_be_is_refused(arguments, text):
    with pytest.raises(TrajectoryError, match=text):
        waypoints(*arguments)
