"""A trajectory is judged with bounded work, and nothing that a finer look shows is missed."""

from math import tau

import numpy as np
import pytest

from companion.drag import Drag
from companion.guidance.trajectory import (
    Envelope,
    Hover,
    Laps,
    TrajectoryError,
    bernoulli_eight,
    circle,
    evenly_slowed,
    gerono_eight,
    helix,
    line,
    slow_down,
    turned_first,
    violations,
    waypoints,
)
from companion.guidance.trajectory.csv_file import Table
from companion.guidance.trajectory.curves import MOST_CHECKS, PATH_STEP
from companion.guidance.trajectory.demand import demand, sampled_motion
from companion.guidance.trajectory.from_samples import SampleOptions, from_samples
from tests.trajectory.finite_differences import evenly

DRAG, G = Drag(0.6), 9.80665


def wavy(rng):
    """Samples of a motion with frequencies up to half the cutoff of 5 Hz."""
    times = np.arange(0.0, 6.0, 0.02)
    phases, rates = rng.uniform(0.0, tau, 3), rng.uniform(0.3, 2.5, 3)
    places = np.sin(np.outer(times, tau * rates) + phases) / (8.0 * rates**2)
    return from_samples(Table(times, places, (), None), SampleOptions())


def some(seed):
    """One trajectory of each kind, at random."""
    rng = np.random.default_rng(seed)
    speed, count = rng.uniform(1.0, 8.0), int(rng.integers(1, 6))
    laps = Laps(speed, count, rng.uniform(0.5, 6.0), face_path=True)
    size = rng.uniform(1.0, 8.0)
    points = [tuple(p) for p in rng.uniform(-8.0, 8.0, (6, 3)).tolist()]
    return [
        circle(size, laps),
        helix(size, rng.uniform(-3.0, 3.0), laps),
        gerono_eight(size, laps),
        bernoulli_eight(size, laps),
        line(points[0], laps.speed, laps.acceleration, 8.0),
        waypoints(points, laps.speed, laps.acceleration, face_path=True),
        wavy(rng),
    ]


def needs(motion):
    """The largest of all that is limited, and the farthest way to each side."""
    rotors, places = demand(motion, DRAG, G), motion.position
    return {
        "tilt": rotors.tilt.max(),
        "tilt rate": rotors.tilt_rate.max(),
        "thrust": rotors.thrust.max(),
        "little thrust": -rotors.thrust.min(),
        "yaw rate": np.abs(motion.heading_rate).max(),
        "speed": np.linalg.norm(motion.velocity, axis=1).max(),
        "climb": -motion.velocity[:, 2].min(),
        "descent": motion.velocity[:, 2].max(),
        "distance": np.hypot(places[:, 0], places[:, 1]).max(),
        **{
            f"{side} of {axis}": (side * places[:, axis]).max()
            for side in (-1, 1)
            for axis in range(3)
        },
    }


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in range(1, 8))]
)
def test_a_finer_look_at_all_of_it_finds_no_more(seed):
    for trajectory in some(seed):
        fine = needs(sampled_motion(trajectory, evenly(trajectory, trajectory.duration / 12_000)))
        for quantity, most in needs(sampled_motion(trajectory)).items():
            missed = fine[quantity] - most
            assert missed <= 0.003 * abs(most) + 2e-3, (trajectory.name, quantity, most, missed)


@pytest.mark.parametrize("seed", [1])
def test_two_looks_are_no_farther_apart_than_told(seed):
    """Where laps are left out the vehicle is at the same place of a lap."""
    for trajectory in some(seed):
        if trajectory.name not in ("circle", "helix", "gerono eight", "bernoulli eight"):
            ways = np.linalg.norm(np.diff(sampled_motion(trajectory).position, axis=0), axis=1)
            assert ways.max() <= 1.02 * PATH_STEP


def test_laps_without_number_cost_no_more_than_a_few():
    few, many = (circle(3.0, Laps(8.0, laps)) for laps in (6.0, 1000.0))
    assert len(many.check_times()) <= len(few.check_times()) + 10
    assert violations(many, Envelope(max_speed=8.0)) == ()
    assert violations(many, Envelope(max_speed=7.9))


def test_the_last_lap_of_a_helix_is_looked_at():
    up = helix(3.0, 2.0, Laps(4.0, 100))
    assert needs(sampled_motion(up))["-1 of 2"] == pytest.approx(200.0)


@pytest.mark.parametrize(
    ("trajectory", "words"),
    [
        (circle(3.0, Laps(2.0, 1000.0)), "it lasts 9426 s, and 3600 s is the longest"),
        (
            circle(0.5, Laps(2.0, 1000.0, acceleration=0.003)),
            "it takes .* samples, more than 80000",
        ),
        (line((1.0, 0.0, 0.0), 1e-4, 1.0, 1.0), "it lasts 1e.04 s"),
        (line((9e4, 0.0, 0.0), 100.0, 9.0, 9.0), "too long to be checked"),
        (evenly_slowed(circle(3.0, Laps(2.0, 1000.0)), 2.0), "3600 s is the longest"),
    ],
)
def test_what_would_take_long_to_judge_is_refused(trajectory, words):
    for judged in (violations, slow_down):
        with pytest.raises(TrajectoryError, match=words):
            judged(trajectory, Envelope(max_speed=1.0))


def test_the_looks_are_bounded_whatever_is_flown():
    """The worst that is accepted: ramps over many laps, long lines, a thousand waypoints."""
    worst = [
        helix(1000.0, 1000.0, Laps(99.0, 3)),
        bernoulli_eight(3.0, Laps(8.0, 1000, acceleration=0.1, face_path=True)),
        line((9000.0, 9000.0, -9000.0), 100.0, 3.0, 3.0),
        waypoints([(float(k % 7), float(k), -1.0) for k in range(1, 1001)], 5.0, 3.0),
    ]
    for trajectory in worst:
        assert len(trajectory.check_times()) <= MOST_CHECKS + 20_000, trajectory.name


def test_waypoints_that_would_last_for_days_are_refused_before_they_are_looked_at():
    with pytest.raises(TrajectoryError, match="3600 s is the longest"):
        waypoints([(9000.0, 0.0, 0.0), (0.0, 0.0, 0.0)], 0.01, 1.0, face_path=True)


def test_a_hover_and_a_turn_are_judged_too():
    assert Hover(5.0).check_times() == [0.0, 5.0]
    turned = turned_first(circle(5.0, Laps(4.0, 2, face_path=True)), 1.0, 0.8)
    assert max(turned.check_times()) == pytest.approx(turned.duration)
