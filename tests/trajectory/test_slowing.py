"""Slowing down in parts: limits hold everywhere, the path is the same, and no more is slowed."""

import pickle
from dataclasses import replace
from functools import cache
from math import radians

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial import cKDTree

from companion.drag import Drag
from companion.flight.maneuvers import overview, slow_down_notes
from companion.guidance.trajectory import (
    Envelope,
    Frame,
    Laps,
    SampleOptions,
    SlowerTime,
    TrajectoryError,
    Violation,
    circle,
    evenly_slowed,
    from_samples,
    gerono_eight,
    helix,
    line,
    motion_violations,
    slow_down,
    violations,
    waypoints,
)
from companion.guidance.trajectory.csv_file import parse_csv
from companion.guidance.trajectory.demand import sampled_motion
from tests.trajectory.finite_differences import (
    assert_derivatives_agree,
    assert_rests_at_both_ends,
    inner_times,
)

G = 9.80665
ENVELOPE = Envelope(
    max_tilt=radians(35.0),
    max_tilt_rate=radians(90.0),
    max_yaw_rate=1.0,
    min_thrust=2.0,
    max_thrust=16.0,
    max_climb=2.0,
    max_descent=1.0,
    max_speed=8.0,
    drag=Drag(0.6, 0.03),
)
EIGHT = gerono_eight(3.0, Laps(5.0, 2, face_path=True))
CORNERS = waypoints([(20.0, 0, 0), (20.0, 3.0, 0), (0, 3.0, -2.0)], 6.0, 9.0)


def _angular(side=12.0, speed=3.0, cutoff=1.0):
    """Samples of three legs with sharp corners, at a steady speed."""
    lines = ["t,x,y,z"]
    for k in range(int(3 * side / speed * 20) + 1):
        way = k / 20 * speed
        x = min(way, side) - min(max(way - 2 * side, 0.0), side)
        lines.append(f"{k / 20},{x},{min(max(way - side, 0.0), side)},0")
    return from_samples(
        parse_csv(lines, "angular"), SampleOptions(Frame.NED, cutoff=cutoff), "angular"
    )


ANGULAR = _angular()
TRAJECTORIES = {
    "eight": EIGHT,
    "corners": CORNERS,
    "angular": ANGULAR,
    "fast line": line((30.0, 10.0, 0.0), 7.0, 9.0, 30.0),
    "many laps": gerono_eight(3.0, Laps(5.0, 12)),
    "circle": circle(5.0, Laps(6.0, 2.0)),
}


@cache
def slowed(name):
    """One of `TRAJECTORIES`, slowed down; it cannot be changed."""
    return slow_down(TRAJECTORIES[name], ENVELOPE).trajectory


def dense_path(trajectory):
    """(40001, 3) places, m; between 5001 samples by cubics, which are off by micrometres."""
    sampled, times = (np.linspace(0.0, trajectory.duration, count) for count in (5001, 40_001))
    samples = [trajectory.at(t) for t in sampled.tolist()]
    places, speeds = [each.position for each in samples], [each.velocity for each in samples]
    return CubicHermiteSpline(sampled, places, speeds)(times)


def needs_by_differences(trajectory, count=2001):
    """Tilt, tilt rate, thrust, climb and speed from the positions alone, by central differences."""
    times = np.linspace(0.02, trajectory.duration - 0.02, count)
    h = 1e-3
    around = np.array(
        [[trajectory.at(t + k * h).position for k in (-2, -1, 0, 1, 2)] for t in times]
    )
    before2, before, here, after, after2 = (around[:, k] for k in range(5))
    velocity = (after - before) / (2 * h)
    acceleration = (after - 2 * here + before) / h**2
    jerk = (after2 - 2 * after + 2 * before - before2) / (2 * h**3)
    speed = np.linalg.norm(velocity, axis=1)
    linear, quadratic = ENVELOPE.drag.linear, ENVELOPE.drag.quadratic
    force = acceleration + (linear + quadratic * speed)[:, None] * velocity - [0.0, 0.0, G]
    along = np.einsum("ij,ij->i", velocity, acceleration) / np.maximum(speed, 1e-9)
    growth = (
        jerk
        + (linear + quadratic * speed)[:, None] * acceleration
        + (quadratic * along)[:, None] * velocity
    )
    thrust = np.linalg.norm(force, axis=1)
    tilt = np.arccos(-force[:, 2] / thrust)
    tilt_rate = np.linalg.norm(np.cross(force, growth), axis=1) / thrust**2
    return tilt, tilt_rate, thrust, -velocity[:, 2], speed


def test_the_limits_hold_where_two_pieces_of_the_stretch_factor_meet():
    """The jerk has its peaks there, and the times checked went past them."""
    envelope = replace(ENVELOPE, max_tilt=radians(50.0), max_tilt_rate=radians(20.0))
    law = slow_down(table := _angular(6.8567, 3.1748, cutoff=3.0), envelope).trajectory.law
    ends = np.linspace(0.0, law.original_duration, len(law.coefficients) - 2)
    slower = sampled_motion(table, ends.tolist()).retimed(*law.stretched_times(ends))
    assert [str(each) for each in motion_violations(slower, envelope)] == []


@pytest.mark.parametrize("name", TRAJECTORIES)
def test_the_limits_hold_everywhere_by_differences_of_the_positions(name):
    after = slowed(name)
    tilt, tilt_rate, thrust, climb, speed = needs_by_differences(after)
    assert tilt.max() <= 1.003 * ENVELOPE.max_tilt
    assert tilt_rate.max() <= 1.01 * ENVELOPE.max_tilt_rate
    assert thrust.min() >= ENVELOPE.min_thrust
    assert thrust.max() <= 1.003 * ENVELOPE.max_thrust
    assert -1.003 * ENVELOPE.max_descent <= climb.min()
    assert climb.max() <= 1.003 * ENVELOPE.max_climb
    assert speed.max() <= 1.003 * ENVELOPE.max_speed
    rates = [abs(after.at(t).heading_rate) for t in inner_times(after, 3001)]
    assert max(rates) <= 1.003 * ENVELOPE.max_yaw_rate


@pytest.mark.parametrize("name", TRAJECTORIES)
def test_the_path_and_its_heading_are_the_same_and_the_derivatives_right(name):
    before = TRAJECTORIES[name]
    after = slowed(name)
    assert (after.name, after.holds_heading) == (before.name, before.holds_heading)
    tree = cKDTree(dense_path(before))
    flown = [after.at(t).position for t in np.linspace(0.0, after.duration, 2001)]
    assert tree.query(flown)[0].max() < 2e-3
    assert flown[0] == (0.0, 0.0, 0.0)
    assert flown[-1] == pytest.approx(before.at(before.duration).position)
    assert_derivatives_agree(after, inner_times(after), jumps=40.0 if "line" in name else 0.0)
    assert_rests_at_both_ends(after)
    copy = pickle.loads(pickle.dumps(after))
    assert copy.at(1.7) == after.at(1.7)


@pytest.mark.parametrize(("name", "longest"), [("eight", 38.0), ("fast line", 7.6)])
def test_short_pieces_are_slowed_again_where_they_still_break_a_limit(name, longest):
    """Longer pieces, which keep the limits at once, would take 43.7 and 7.9 s."""
    assert slowed(name).duration <= longest


def test_two_corners_are_slowed_down_and_the_legs_are_not():
    found = slow_down(ANGULAR, ENVELOPE)
    assert not found.is_even
    even = evenly_slowed(ANGULAR, max(part.factor for part in found.parts))
    assert found.trajectory.duration < 0.9 * even.duration
    as_before = [
        t
        for t in inner_times(found.trajectory, 400)
        if not any(part.begin <= t <= part.end for part in found.parts)
    ]
    assert len(as_before) > 100
    for t in as_before:
        assert found.trajectory.law.at(t).first_derivative > 0.97
    notes = slow_down_notes(ANGULAR, found, 0.5)
    assert notes[0].startswith("angular is slowed down to keep its limits: from ")
    assert ", because of limits.max_tilt_rate_deg_s at" in notes[0]  # without the reserve
    assert f"instead of {ANGULAR.duration:.1f} s, and its highest speed is" in notes[1]
    assert f"{found.trajectory.duration:.1f} s, at most" in overview(found.trajectory)
    for part_count, more in ((5, "; and in 1 more part"), (6, "; and in 2 more parts")):
        parts = found.parts[:1] * part_count
        assert slow_down_notes(ANGULAR, found._replace(parts=parts), 0.5)[0].endswith(more)
    as_fast = slow_down_notes(ANGULAR, found._replace(trajectory=ANGULAR), 0.5)[1]
    assert "and its highest speed is still" in as_fast


@pytest.mark.parametrize(
    ("reserve", "limit"),
    [
        (0.5, "limits.max_tilt_deg (minus flight.slow_down_reserve_m_s2: 0.5) at"),
        (0.0, "limits.max_tilt_deg at"),
    ],
)
def test_a_part_that_the_tilt_limit_slows_names_the_reserve_below_it(reserve, limit):
    found = slow_down(EIGHT, Envelope(max_tilt=radians(2.0)))
    assert f", because of {limit}" in slow_down_notes(EIGHT, found, reserve)[0]


@pytest.mark.parametrize(
    "envelope",
    [
        Envelope(max_tilt=radians(35.0), drag=Drag(1.0)),
        Envelope(max_tilt_rate=radians(90.0), drag=Drag(1.0)),
        Envelope(max_yaw_rate=1.0),
        Envelope(max_speed=1.0),
        Envelope(max_tilt=radians(2.0), drag=Drag(1.0)),
    ],
)
def test_it_is_as_quick_as_an_even_slowing_at_least_and_no_quicker_than_allowed(envelope):
    found = slow_down(EIGHT, envelope)
    assert violations(found.trajectory, envelope) == ()
    assert found.trajectory.duration > EIGHT.duration
    factor = found.trajectory.duration / EIGHT.duration
    assert violations(evenly_slowed(EIGHT, 0.97 * factor), envelope)


def test_a_steady_speed_is_slowed_evenly_by_the_ratio_of_speeds():
    steady = circle(30.0, Laps(5.0, 1.0, acceleration=50.0))
    found = slow_down(steady, Envelope(max_speed=2.0))
    fastest = max(
        np.linalg.norm(found.trajectory.at(t).velocity) for t in inner_times(found.trajectory, 500)
    )
    assert fastest == pytest.approx(2.0, rel=5e-3)


def test_what_can_be_flown_is_not_slowed():
    found = slow_down(EIGHT, Envelope(max_speed=5.0))
    assert (found.trajectory, found.parts) == (EIGHT, ())
    assert slow_down_notes(EIGHT, found, 0.5) == ()


def test_what_is_too_long_is_slowed_evenly_and_says_so():
    laps = gerono_eight(3.0, Laps(5.0, 150.0))
    found = slow_down(laps, ENVELOPE)
    assert found.is_even
    assert violations(found.trajectory, ENVELOPE) == ()
    note, _ = slow_down_notes(laps, found, 0.5)
    assert "it is too long to be slowed down in parts; its tightest limit is limits." in note


def test_what_would_take_longer_than_an_hour_slowed_down_is_refused():
    with pytest.raises(TrajectoryError, match=r"to keep limits\.max_climb_m_s, it lasts 6414 s"):
        slow_down(helix(5.0, 31.4, Laps(5.0, 20.0)), Envelope(max_climb=0.1))


def test_an_even_slowing_names_the_limit_that_asks_for_most():
    climbing = helix(5.0, 3.0, Laps(5.0, 110.0))
    envelope = Envelope(max_climb=0.1, max_speed=4.5)
    (whole,) = slow_down(climbing, envelope).parts
    assert whole.limit == "limits.max_climb_m_s"
    slower = evenly_slowed(climbing, 0.99 * whole.factor)
    (broken,) = violations(slower, envelope)
    assert broken.limit == whole.limit
    assert whole.time == pytest.approx(broken.time, rel=0.02)


def test_a_limit_that_slowing_down_cannot_keep_is_reported_at_its_own_time():
    wall = Violation("limits.fence_radius_m", 1.0, 2.0, "it leaves", "shrink it", False)
    with pytest.raises(TrajectoryError, match=r"gerono eight: it leaves; shrink it"):
        slow_down(EIGHT, Envelope(max_tilt=0.3, fence=lambda _: wall))


def test_a_slower_time_has_right_derivatives_and_is_found_again():
    law = SlowerTime(6.0, (1.0, 1.0, 1.0, 2.5, 1.7, 1.0, 1.2, 1.0, 1.0))
    h = 1e-4
    for time in np.linspace(0.01, law.duration - 0.01, 97):
        before, here, after = (law.at(time + k * h) for k in (-1, 0, 1))
        assert here.first_derivative == pytest.approx(
            (after.phase - before.phase) / (2 * h), rel=1e-6
        )
        assert here.second_derivative == pytest.approx(
            (after.first_derivative - before.first_derivative) / (2 * h), abs=1e-6
        )
        assert here.third_derivative == pytest.approx(
            (after.second_derivative - before.second_derivative) / (2 * h), abs=2e-4
        )
        assert 1 / 2.5 <= here.first_derivative <= 1.0
        times, _ = law.stretched_times(np.array([here.phase]))
        assert times[0] == pytest.approx(time, abs=1e-12)
    assert law.at(-1.0).phase == 0.0
    assert law.at(law.duration + 1.0).phase == pytest.approx(6.0)
