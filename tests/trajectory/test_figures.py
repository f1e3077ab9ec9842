"""Figures and lines: derivatives, ends, form, speeds and headings."""

from math import atan2, hypot, inf, pi, tau

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.guidance.trajectory import (
    Hover,
    Laps,
    TrajectoryError,
    bernoulli_eight,
    circle,
    gerono_eight,
    helix,
    line,
)
from tests.trajectory.finite_differences import (
    assert_derivatives_agree,
    assert_rests_at_both_ends,
    inner_times,
    largest,
)

_sizes = st.floats(0.5, 20.0)
_speeds = st.floats(0.2, 8.0)
_accelerations = st.floats(0.5, 8.0)
_directions = st.floats(-pi, pi)
_laps = st.builds(Laps, _speeds, st.integers(1, 3), _accelerations, _directions, st.booleans())
_eights = st.one_of(
    st.builds(gerono_eight, _sizes, _laps), st.builds(bernoulli_eight, _sizes, _laps)
)
_rounds = st.one_of(
    st.builds(circle, _sizes, _laps), st.builds(helix, _sizes, st.floats(-5.0, 5.0), _laps)
)
_places = st.tuples(*[st.floats(-30.0, 30.0)] * 3).filter(lambda p: hypot(p[0], p[1]) > 0.1)


@settings(max_examples=60)
@given(st.one_of(_eights, _rounds))
def test_derivatives_of_figures_agree_with_finite_differences(figure):
    assert_derivatives_agree(figure, inner_times(figure))
    assert_rests_at_both_ends(figure)


@settings(max_examples=40)
@given(st.one_of(_eights, _rounds), st.floats(0.0, 1.0))
def test_the_jerk_of_figures_is_continuous(figure, share):
    """Also where a ramp joins the steady pace, which it meets at the ends of the ramps."""
    joints = (figure.law.rise_time, figure.duration - figure.law.fall_time)
    for t in (share * figure.duration, 0.0, figure.duration, *joints):
        before, after = (figure.at(t + d).jerk for d in (-1e-7, 1e-7))
        # A short ramp may lie between two of the 200 places: its own jerk counts, too.
        scale = 1.0 + max(largest(figure, "jerk", count=200), float(np.linalg.norm(before)))
        np.testing.assert_allclose(before, after, atol=1e-4 * scale)


@settings(max_examples=25)
@given(st.data(), _speeds, _accelerations, st.integers(1, 3))
def test_the_peak_speed_is_the_one_asked_for(data, speed, acceleration, laps):
    kind = data.draw(st.sampled_from([gerono_eight, bernoulli_eight, circle]))
    figure = kind(data.draw(_sizes), Laps(speed, laps, acceleration))
    assert largest(figure, "velocity", count=4001) == pytest.approx(speed, rel=1e-5)


def test_the_peak_speed_of_a_helix_counts_its_rise():
    assert largest(helix(2.0, 6.0, Laps(3.0, 3)), "velocity") == pytest.approx(3.0)


def test_speed_along_a_circle_is_gathered_with_the_acceleration_asked_for():
    gathering = circle(20.0, Laps(5.0, 2.0, acceleration=2.0))
    speeds = [hypot(*gathering.at(t).velocity) for t in np.linspace(0.0, gathering.duration, 5001)]
    steepest = np.abs(np.diff(speeds)).max() / (gathering.duration / 5000)
    assert steepest == pytest.approx(2.0, rel=1e-4)


def test_few_laps_take_more_acceleration_and_still_reach_the_speed():
    assert largest(circle(1.0, Laps(4.0, 0.5, 0.5)), "velocity") == pytest.approx(4.0)


@pytest.mark.parametrize("direction", [0.0, 2.0])
def test_a_circle_has_its_centre_where_it_was_asked_for_and_ends_where_it_began(direction):
    round_ = circle(5.0, Laps(4.0, 2.0, direction=direction))
    centre = 5.0 * np.cos(direction), 5.0 * np.sin(direction), 0.0
    angles = []
    for t in inner_times(round_, 400):
        arm = np.subtract(round_.at(t).position, centre)
        assert np.linalg.norm(arm) == pytest.approx(5.0)
        assert arm[2] == 0.0
        angles.append(atan2(arm[1], arm[0]))
    # Anticlockwise from above: the bearing from the centre falls.
    assert np.unwrap(angles)[-1] - np.unwrap(angles)[0] == pytest.approx(-2.0 * tau, abs=1e-3)
    assert round_.at(round_.duration).position == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


def test_a_helix_rises_evenly_with_its_angle():
    rising = helix(3.0, 1.5, Laps(2.0, 2.0))
    assert rising.at(rising.duration).position == pytest.approx((0.0, 0.0, -3.0), abs=1e-9)
    half = rising.at(rising.duration / 2.0)
    assert half.position == pytest.approx((0.0, 0.0, -1.5), abs=1e-9)
    assert half.velocity[2] < 0.0


def test_eights_lie_on_their_lemniscates():
    """The implicit equations: Gerono n⁴ = A²(n² − e²), Bernoulli (n² + e²)² = A²(n² − e²)."""
    for eight, power in (
        (gerono_eight(3.0, Laps(2.0)), lambda n, e: n**4),
        (bernoulli_eight(3.0, Laps(2.0)), lambda n, e: (n**2 + e**2) ** 2),
    ):
        places = np.array([eight.at(t).position for t in inner_times(eight)])
        n, e = places[:, 0], places[:, 1]
        np.testing.assert_allclose(power(n, e), 9.0 * (n**2 - e**2), atol=1e-9)
        assert n.max() == pytest.approx(3.0, abs=1e-2)
        assert n.min() == pytest.approx(-3.0, abs=1e-2)


def test_a_direction_turns_an_eight_clockwise():
    straight, turned = (gerono_eight(3.0, Laps(2.0, direction=d)) for d in (0.0, pi / 2.0))
    for t in inner_times(straight, 20):
        north, east, _ = straight.at(t).position
        assert turned.at(t).position == pytest.approx((-east, north, 0.0))


@settings(max_examples=40)
@given(st.one_of(_eights, _rounds))
def test_a_heading_along_the_path_is_that_of_the_velocity_and_never_jumps(figure):
    headings = []
    for t in inner_times(figure, 400):
        sample = figure.at(t)
        headings.append(sample.heading)
        if figure.holds_heading:
            assert (sample.heading, sample.heading_rate) == (0.0, 0.0)
        elif hypot(*sample.velocity[:2]) > 1e-3:
            along = atan2(sample.velocity[1], sample.velocity[0])
            assert np.cos(along - sample.heading) == pytest.approx(1.0)
    assert np.abs(np.diff(headings)).max() < 1.0


@settings(max_examples=60)
@given(_places, _speeds, _accelerations, st.floats(1.0, 50.0), st.booleans())
def test_a_line_keeps_its_limits_and_arrives(to, speed, acceleration, jerk, along):
    straight = line(to, speed, acceleration, jerk, along)
    assert_derivatives_agree(straight, inner_times(straight), jumps=jerk)
    assert_rests_at_both_ends(straight)
    assert straight.at(straight.duration).position == pytest.approx(to)
    fastest, strongest, jerkiest = largest(straight, "velocity", "acceleration", "jerk", count=500)
    assert fastest <= speed * (1 + 1e-9)
    assert strongest <= acceleration * (1 + 1e-9)
    assert jerkiest == pytest.approx(jerk)
    if along:
        assert straight.at(1.0).heading == pytest.approx(atan2(to[1], to[0]))


@pytest.mark.parametrize(
    ("length", "limits", "duration"),
    [
        # All seven pieces: L/v + v/a + a/j.
        (30.0, (4.0, 2.0, 4.0), 30.0 / 4.0 + 4.0 / 2.0 + 2.0 / 4.0),
        # The speed is reached before the acceleration: L/v + 2√(v/j).
        (30.0, (1.0, 5.0, 4.0), 30.0 / 1.0 + 2.0 * (1.0 / 4.0) ** 0.5),
        # Too short for the acceleration: 4·(L/2j)^⅓.
        (0.5, (9.0, 9.0, 4.0), 4.0 * (0.5 / 8.0) ** (1.0 / 3.0)),
        # Too short for the speed alone: 2·(½a/j + √((½a/j)² + L/a)).
        (10.0, (9.0, 2.0, 4.0), 2.0 * (0.25 + (0.25**2 + 10.0 / 2.0) ** 0.5)),
    ],
)
def test_a_line_takes_the_shortest_time_there_is(length, limits, duration):
    """Biagiotti & Melchiorri, section 3.4, for each of the four kinds of profile."""
    assert line((0.0, length, 0.0), *limits).duration == pytest.approx(duration)


def test_hover_stays():
    hover = Hover(3.0)
    assert_rests_at_both_ends(hover)
    assert hover.at(1.0).position == (0.0, 0.0, 0.0)
    assert hover.duration == 3.0
    assert hover.holds_heading


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: line((0.0, 0.0, 0.0), 1.0, 1.0, 1.0), "end at another point"),
        (lambda: line((0.0, 0.0, 1.0), 1.0, 1.0, 1.0, face_path=True), "vertical line"),
        (lambda: line((1.0, 0.0, 0.0), 1.0, 0.0, 1.0), "must be positive"),
        (lambda: line((1.0, 0.0, 0.0), 1.0, 1.0, inf), "positive and finite"),
        (lambda: circle(0.0, Laps(1.0)), "size, speed, laps and acceleration of a circle"),
        (lambda: helix(1.0, 1.0, Laps(1.0, 0.0)), "of a helix must be positive"),
        (lambda: gerono_eight(1.0, Laps(1.0, 1.5)), "laps of a figure-eight must be a whole"),
    ],
)
def test_what_cannot_be_is_refused(make, text):
    with pytest.raises(TrajectoryError, match=text):
        make()
