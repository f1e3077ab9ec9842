"""Feasibility: what a trajectory demands, which limit breaks when, and how slow is slow enough."""

from math import atan, degrees, hypot, nan, pi, radians

import numpy as np
import pytest

from companion.drag import NO_DRAG, Drag
from companion.guidance.trajectory import (
    Envelope,
    Hover,
    Laps,
    circle,
    evenly_slowed,
    gerono_eight,
    line,
    turned_first,
    violations,
    waypoints,
)
from companion.guidance.trajectory.demand import demand, sampled_motion
from tests.trajectory.finite_differences import (
    assert_derivatives_agree,
    assert_rests_at_both_ends,
    evenly,
    inner_times,
)

G = 9.80665
EIGHT = gerono_eight(3.0, Laps(5.0, 2))
CLIMB = line((0.0, 0.0, -8.0), 3.0, 2.0, 4.0)


def test_the_demand_is_that_of_the_force_that_moves_the_vehicle():
    """The thrust axis and its turning, by differences of directions, with drag and in space."""
    drag, h = Drag(0.7, 0.05), 1e-5
    path = waypoints([(4.0, 0.0, -2.0), (4.0, 5.0, 0.0), (0.0, 1.0, -3.0)], 4.0, 6.0)
    motion = sampled_motion(path, evenly(path, 0.02))
    found = demand(motion, drag, G)

    def axis(time):
        s = path.at(time)
        force = np.array(s.acceleration) + np.array(drag.deceleration(s.velocity)) - (0.0, 0.0, G)
        return force / np.linalg.norm(force), np.linalg.norm(force)

    for k in range(5, len(motion.times) - 5):
        direction, length = axis(motion.times[k])
        assert found.thrust[k] == pytest.approx(length)
        assert found.tilt[k] == pytest.approx(np.arccos(-direction[2]), abs=1e-7)
        turn = np.subtract(axis(motion.times[k] + h)[0], axis(motion.times[k] - h)[0]) / (2.0 * h)
        assert found.tilt_rate[k] == pytest.approx(np.linalg.norm(turn), rel=1e-5, abs=1e-6)


@pytest.mark.parametrize(("speed", "drag"), [(7.0, 0.0), (5.0, 1.0)])
def test_the_tilt_of_a_circle_is_that_of_the_books(speed, drag):
    tilt = atan(hypot(speed**2 / 5.0, drag * speed) / G)
    round_ = circle(5.0, Laps(speed, 4.0, acceleration=1.0))
    assert violations(round_, Envelope(max_tilt=tilt + 0.002, drag=Drag(drag))) == ()
    (broken,) = violations(round_, Envelope(max_tilt=tilt - 0.002, drag=Drag(drag)))
    assert broken.limit == "limits.max_tilt_deg"


def test_a_violation_says_when_what_and_how_much():
    (broken,) = violations(EIGHT, Envelope(max_tilt=radians(35.0), drag=Drag(1.0)))
    assert broken.begin_time < broken.time
    motion = sampled_motion(EIGHT, evenly(EIGHT, 0.005))
    tilt = demand(motion, Drag(1.0), G).tilt
    first = motion.times[np.argmax(tilt > radians(35.0))]
    assert broken.begin_time == pytest.approx(first, abs=0.01)
    assert broken.text == (
        f"at {broken.time:.2f} s it needs {degrees(tilt.max()):.4g}° of tilt, "
        f"limits.max_tilt_deg allows 35 (violated from {broken.begin_time:.2f} s on)"
    )
    assert str(broken) == broken.text


# What each limit is about, a trajectory that reaches it, and what it needs, in the limit's unit.
CASES = [
    ("max_tilt_rate", EIGHT, radians(125.0), "max_tilt_rate_deg_s", 1.0),
    ("max_yaw_rate", circle(5.0, Laps(5.0, 2, face_path=True)), 1.0, "max_yaw_rate_deg_s", 0.0),
    ("min_thrust", CLIMB, G - 2.0, "min_thrust", 0.0),
    ("max_thrust", CLIMB, G + 2.0, "max_thrust", 0.0),
    ("max_climb", CLIMB, 3.0, "max_climb_m_s", 0.0),
    ("max_descent", line((0.0, 0.0, 8.0), 3.0, 2.0, 4.0), 3.0, "max_descent_m_s", 0.0),
]


@pytest.mark.parametrize(
    ("field", "trajectory", "need", "key", "drag"), CASES, ids=lambda x: str(x)[:16]
)
def test_each_limit_is_broken_where_the_need_exceeds_it_and_only_there(
    field, trajectory, need, key, drag
):
    least = field == "min_thrust"
    slack = 0.01 * abs(need) * (-1.0 if least else 1.0)
    assert violations(trajectory, Envelope(**{field: need + slack}, drag=Drag(drag))) == ()
    (broken,) = violations(trajectory, Envelope(**{field: need - slack}, drag=Drag(drag)))
    assert broken.limit == f"limits.{key}"
    assert f"limits.{key} allows {'no less than ' if least else ''}" in broken.text


@pytest.mark.parametrize(
    ("field", "share", "allowed"),
    [("min_thrust", 0.45, "0.45 allows no less than 9"), ("max_thrust", 0.55, "0.55 allows 11")],
)
def test_a_thrust_limit_is_told_as_its_key_has_it(field, share, allowed):
    (broken,) = violations(CLIMB, Envelope(**{field: 20.0 * share}, full_thrust=20.0))
    assert f" m/s² of thrust, limits.{field} = {allowed} m/s²" in broken.text


def test_a_limit_that_is_just_met_is_kept():
    assert violations(EIGHT, Envelope(max_speed=5.0)) == ()
    assert violations(circle(5.0, Laps(5.0, 2)), Envelope(max_tilt=atan(5.0 / G))) == ()


@pytest.mark.parametrize("wrong", [0.0, -0.1, 0.5 * pi, 35.0, nan])
def test_a_tilt_limit_is_an_angle_below_the_horizontal(wrong):
    """35 is meant in degrees."""
    assert Envelope(max_tilt=1.57).max_tilt == 1.57
    with pytest.raises(ValueError, match=r"^max_tilt must be in \(0, π/2\) rad, not "):
        Envelope(max_tilt=wrong)


@pytest.mark.parametrize("limit", ["max_tilt_rate", "min_thrust", "max_climb", "gravity"])
def test_a_limit_of_less_than_nothing_or_of_no_number_is_refused(limit):
    assert getattr(Envelope(**{limit: 0.0}), limit) == 0.0
    for wrong in (-0.1, nan):
        with pytest.raises(ValueError, match=f"^{limit} must be 0 or more, or None for no limit"):
            Envelope(**{limit: wrong})


def test_all_broken_limits_are_told_in_the_order_of_time():
    broken = violations(EIGHT, Envelope(max_speed=4.0, max_tilt=0.3, max_tilt_rate=0.1))
    assert {one.limit for one in broken} == {
        "safety.max_speed_m_s",
        "limits.max_tilt_deg",
        "limits.max_tilt_rate_deg_s",
    }
    assert [one.begin_time for one in broken] == sorted(one.begin_time for one in broken)


def test_free_fall_demands_no_thrust_and_no_turning():
    falling = line((0.0, 0.0, 60.0), 100.0, G, 20.0)
    found = demand(sampled_motion(falling, evenly(falling, 0.005)), NO_DRAG, G)
    assert found.thrust.min() == pytest.approx(0.0, abs=1e-9)
    assert np.isfinite(found.tilt_rate).all()


@pytest.mark.parametrize("factor", [0.5, 3.0])
def test_a_slowed_trajectory_has_right_derivatives_and_the_same_way(factor):
    along = gerono_eight(3.0, Laps(2.0, 1, face_path=True))
    slowed = evenly_slowed(along, factor)
    assert_derivatives_agree(slowed, inner_times(slowed))
    assert_rests_at_both_ends(slowed)
    assert (slowed.name, slowed.holds_heading) == (along.name, False)
    for share in np.linspace(0.0, 1.0, 11):
        place = along.at(share * along.duration)
        assert slowed.at(share * slowed.duration).position == pytest.approx(place.position)
        assert slowed.at(share * slowed.duration).heading == pytest.approx(place.heading)


@pytest.mark.parametrize(("heading", "turned"), [(0.5, 1.07), (-2.0, -2.71), (4.0, -2.43)])
def test_a_trajectory_with_a_heading_begins_with_a_turn_the_short_way(heading, turned):
    along = circle(5.0, Laps(4.0, 2, face_path=True))
    whole = turned_first(along, heading, 0.8)
    start = whole.at(0.0)
    assert np.exp(1j * start.heading) == pytest.approx(np.exp(1j * heading))
    assert_derivatives_agree(whole, inner_times(whole, 300))
    turn = whole.duration - along.duration
    assert along.at(0.0).heading - start.heading == pytest.approx(turned, abs=0.01)
    assert turn == pytest.approx(2.0 * abs(turned) / 0.8, abs=0.03)
    rates = [abs(whole.at(t).heading_rate) for t in np.linspace(0.0, turn, 1001)]
    assert max(rates) == pytest.approx(0.8, rel=1e-4)
    assert whole.at(0.5 * turn).position == (0.0, 0.0, 0.0)
    for found, expected in zip(whole.at(turn + 3.0), along.at(3.0), strict=True):
        assert found == pytest.approx(expected)
    assert not whole.holds_heading


def test_nothing_turns_that_need_not():
    hover, along = Hover(3.0), line((0.0, 4.0, 0.0), 2.0, 2.0, 5.0, face_path=True)
    assert turned_first(hover, 1.0, 0.8) is hover
    assert turned_first(along, along.at(0.0).heading, 0.8) is along
