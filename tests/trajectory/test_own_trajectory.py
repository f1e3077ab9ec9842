"""What is refused of a trajectory that a program made, and that no trajectory of ours is."""

from math import cos, inf, nan, pi, sin

import numpy as np
import pytest

from companion.config import trajectory_file
from companion.guidance.trajectory import (
    Envelope,
    Hover,
    Laps,
    Sample,
    TrajectoryError,
    bernoulli_eight,
    circle,
    evenly_slowed,
    gerono_eight,
    helix,
    line,
    require_trajectory,
    slow_down,
    straight_legs,
    waypoints,
)
from tests.flight.fly import CONFIGS

REST = (0.0, 0.0, 0.0)
LAPS = Laps(speed=3.0, face_path=True)
POINTS = [(4.0, 0.0, 0.0), (4.0, 4.0, -1.0), (0.0, 4.0, 0.0)]


class Sway:
    """To and fro along the north axis: 1 m in 4 s, and back in 4 s."""

    name = "sway"
    holds_heading = True
    duration = 8.0

    def __init__(self, wrong=None):
        self.wrong = wrong or {}

    def at(self, time):
        time = min(max(time, 0.0), self.duration)
        turn = 0.25 * pi
        values = {
            "position": 0.5 - 0.5 * cos(turn * time),
            "velocity": 0.5 * turn * sin(turn * time),
            "acceleration": 0.5 * turn**2 * cos(turn * time),
            "jerk": -0.5 * turn**3 * sin(turn * time),
        }
        for name, change in self.wrong.items():
            values[name] = change(values[name], time)
        return Sample(*((value, 0.0, 0.0) for value in values.values()), 0.0, 0.0)

    def check_times(self):
        return [0.1 * k for k in range(81)]


OURS = [
    line((5.0, 0.0, 0.0), 1.0, 0.9, 1000.0),  # the acceleration jumps within 1 ms
    circle(0.8, Laps(speed=0.2, acceleration=50.0)),  # a ramp of 9 ms
    Sway(),
    Hover(3.0),
    Hover(0.0),
    Hover(2.0, heading=1.0),
    line((3.0, 1.0, -1.0), 2.0, 2.0, 4.0),
    line((3.0, 1.0, -1.0), 2.0, 2.0, 4.0, face_path=True),
    circle(5.0, LAPS),
    helix(4.0, 1.0, LAPS),
    gerono_eight(3.0, LAPS),
    bernoulli_eight(3.0, LAPS),
    waypoints(POINTS, 3.0, 2.0),
    straight_legs(POINTS, 3.0, 2.0, 4.0),
    evenly_slowed(circle(5.0, LAPS), 1.7),
    slow_down(circle(2.0, Laps(speed=6.0)), Envelope(max_tilt=0.4)).trajectory,
    *(trajectory_file.load(path) for path in sorted((CONFIGS / "trajectories").glob("*.yaml"))),
    trajectory_file.load(CONFIGS / "trajectories" / "loop.csv"),
]


@pytest.mark.parametrize("trajectory", OURS, ids=lambda each: each.name)
def test_good_trajectories_fit_themselves(trajectory):
    require_trajectory(trajectory)


def test_messages_and_the_record_name_a_trajectory_by_its_shape():
    named = {
        "line": line((3.0, 1.0, -1.0), 2.0, 2.0, 4.0),
        "circle": circle(5.0, LAPS),
        "helix": helix(4.0, 1.0, LAPS),
        "gerono eight": gerono_eight(3.0, LAPS),
        "bernoulli eight": bernoulli_eight(3.0, LAPS),
        "waypoints": waypoints(POINTS, 3.0, 2.0),
        "straight legs": straight_legs(POINTS, 3.0, 2.0, 4.0),
    }
    assert [each.name for each in named.values()] == list(named)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"position": lambda x, t: x + 3.0}, r"begins 3\.00 m from \(0, 0, 0\)"),
        ({"velocity": lambda v, t: v + 1.0}, r"begins at 1\.00 m/s"),
        ({"velocity": lambda v, t: v + 0.1 * t}, r"ends at 0\.80 m/s"),
        ({"velocity": lambda v, t: 0.0}, "its position changes by"),
        ({"velocity": lambda v, t: -v}, "its position changes by"),
        ({"acceleration": lambda a, t: 0.0}, "its velocity changes by"),
        ({"acceleration": lambda a, t: nan}, "not finite"),
        ({"position": lambda x, t: nan if 2.0 < t < 4.0 else x}, "not finite"),
    ],
)
def test_samples_that_do_not_fit_are_refused(wrong, words):
    with pytest.raises(TrajectoryError, match=words):
        require_trajectory(Sway(wrong))


@pytest.mark.parametrize("times", [[], [1.0, 8.0], [0.0, 4.0], [0.0, 5.0, 4.0, 8.0], [-1.0, 9.0]])
def test_check_times_cover_the_trajectory(times):
    sway = Sway()
    sway.check_times = lambda: times
    with pytest.raises(TrajectoryError, match=r"check_times\(\) must ascend from 0"):
        require_trajectory(sway)


def test_check_times_may_be_an_array():
    sway = Sway()
    sway.check_times = lambda: np.linspace(0.0, 8.0, 81)
    require_trajectory(sway)


@pytest.mark.parametrize("duration", [-1.0, nan, inf])
def test_a_duration_is_a_time(duration):
    sway = Sway()
    sway.duration = duration
    with pytest.raises(TrajectoryError, match="its duration must be"):
        require_trajectory(sway)


@pytest.mark.parametrize("returned", [None, REST, (REST, REST), (REST, REST, REST, REST, "a", 0)])
def test_a_sample_is_a_sample(returned):
    sway = Sway()
    sway.at = lambda time: returned
    with pytest.raises(TypeError, match="is no Sample"):
        require_trajectory(sway)


@pytest.mark.parametrize(
    "limits",
    [
        {"max_tilt": 35.0},  # degrees: no trajectory broke it
        {"max_tilt": nan},
        {"max_tilt": 0.0},
        {"max_speed": nan},
        {"max_climb": -1.0},
        {"min_thrust": nan},
    ],
)
def test_limits_that_nothing_would_break_are_refused(limits):
    with pytest.raises(ValueError, match=next(iter(limits))):
        Envelope(**limits)


@pytest.mark.parametrize(
    "make",
    [
        lambda: line((1.0, 0.0, 0.0), nan, 1.0, 1.0),
        lambda: line((1.0, 0.0, 0.0), 1.0, nan, 1.0),
        lambda: circle(nan, LAPS),
        lambda: circle(5.0, Laps(speed=nan)),
        lambda: circle(5.0, Laps(speed=inf)),
        lambda: circle(5.0, Laps(speed=3.0, laps=nan)),
        lambda: helix(5.0, nan, LAPS),
        lambda: gerono_eight(3.0, Laps(speed=nan)),
        lambda: Hover(nan),
        lambda: Hover(-1.0),
        lambda: waypoints(POINTS, nan, 2.0),
        lambda: waypoints([(1.0, 0.0)], 3.0, 2.0),
        lambda: waypoints([(1.0, nan, 0.0)], 3.0, 2.0),
        lambda: waypoints([], 3.0, 2.0),
        lambda: straight_legs(POINTS, 3.0, nan, 4.0),
        lambda: evenly_slowed(circle(5.0, LAPS), 0.0),
        lambda: evenly_slowed(circle(5.0, LAPS), nan),
    ],
)
def test_shapes_of_numbers_that_are_none_are_refused_when_they_are_made(make):
    with pytest.raises(TrajectoryError):
        make()


def test_waypoints_may_be_an_array():
    assert waypoints(np.array(POINTS), 3.0, 2.0).duration == waypoints(POINTS, 3.0, 2.0).duration


def test_vectors_of_another_length_are_no_sample():
    class Wrong(Sway):
        def at(self, time):
            return Sample((0.0,) * 4, (0.0,) * 2, (0.0,) * 3, (0.0,) * 3, 0.0, 0.0)

    with pytest.raises(TypeError, match="which is no Sample"):
        require_trajectory(Wrong())
