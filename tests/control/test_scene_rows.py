"""What 3D viewers show of a vehicle: arrows along the thrust, and paths; judged by SciPy."""

from math import sqrt

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from companion.attitude import BodyRates, Target
from companion.control import scene_rows
from companion.control.guidance_command import GuidanceCommand
from companion.control.scene_rows import SceneWriter
from companion.guidance import GRAVITY
from tests.control.kept_messages import KeptMessages

Q = (0.8, 0.4, -0.4, 0.2)  # of length 1
LEVEL = (1.0, 0.0, 0.0, 0.0)
COMMAND = GuidanceCommand(Target(0.3, 0.1, 0.5), -0.5, 0.0)
STEP_NS = 100_000_000


@pytest.fixture
def drawn(monkeypatch):
    """Draws, and returns the entities of a topic: a list of tuples."""
    monkeypatch.setattr(scene_rows, "scene_message", lambda time_ns, entities: entities)
    rows, kept = SceneWriter(), KeptMessages()

    def draw(*, command=None, q=LEVEL, times=(0,), position=(1.0, 2.0, 3.0)):
        if command is not None:
            rows.note_command(command)
        for time in times:
            rows.draw(kept, time, q, position, (4.0, 5.0, 6.0))
        return {topic: [data for _, data in kept.messages[topic]] for topic in ("/scene", "/paths")}

    return draw


def arrows(drawn_topics):
    (thrust,) = (one for one in drawn_topics["/scene"][-1] if one.name == "thrust")
    assert (thrust.frame, thrust.follows_frame) == ("vehicle", True)
    return thrust.arrows


def direction(arrow, q):
    """Direction of an arrow in the world, NED; its pose is in the frame of the vehicle, FLU."""
    forward, left, up = Rotation.from_quat(arrow.pose[3:]).apply((1.0, 0.0, 0.0))
    w, x, y, z = q
    return Rotation.from_quat((x, y, z, w)).apply((forward, -left, -up))


@pytest.mark.parametrize("q", [LEVEL, Q])
def test_the_arrows_point_along_the_thrust_and_along_the_commanded_thrust(drawn, q):
    own, commanded = arrows(drawn(command=COMMAND, q=q))
    w, x, y, z = q
    thrust_axis = Rotation.from_quat((x, y, z, w)).apply((0.0, 0.0, -1.0))
    assert direction(own, q) == pytest.approx(thrust_axis)
    wanted = (0.3, 0.1, -sqrt(1.0 - 0.3**2 - 0.1**2))
    assert direction(commanded, q) == pytest.approx(wanted)
    for arrow in (own, commanded):
        assert arrow.pose[:3] == (0.0, 0.0, 0.08)


def test_an_arrow_is_as_long_as_the_thrust_that_carries_the_vehicle(drawn):
    """0.1 m for 1 m/s²; a tilted vehicle needs more."""
    for arrow in arrows(drawn(command=COMMAND)):
        cosine = -direction(arrow, LEVEL)[2]
        length = arrow.shaft_length + arrow.head_length
        assert length == pytest.approx(0.1 * (GRAVITY + 0.5) / cosine)
        assert arrow.head_length == 0.15


@pytest.mark.parametrize(
    ("command", "length"),
    [
        (COMMAND._replace(acceleration_down=GRAVITY), 0.01),  # it falls freely
        (COMMAND._replace(thrust=0.4), 0.1 * GRAVITY),  # no vertical acceleration is wanted
    ],
)
def test_the_length_without_a_vertical_acceleration(drawn, command, length):
    own = arrows(drawn(command=command))[0]
    assert own.shaft_length + own.head_length == pytest.approx(length)
    assert own.head_length == pytest.approx(min(0.15, 0.4 * length))


def test_an_arrow_of_a_vehicle_on_its_side_is_not_endless(drawn):
    side = (sqrt(0.5), sqrt(0.5), 0.0, 0.0)
    own = arrows(drawn(command=COMMAND, q=side))[0]
    assert own.shaft_length + own.head_length == pytest.approx(0.1 * (GRAVITY + 0.5) / 0.2)


@pytest.mark.parametrize(
    ("command", "count"),
    [
        (None, 0),
        (COMMAND._replace(idle=True), 0),
        (COMMAND._replace(body_rates=BodyRates(0.1, 0.0, 0.0)), 1),
        (COMMAND._replace(target=Target(0.8, 0.6, 0.0)), 1),  # horizontal: no upright attitude
        (COMMAND, 2),
    ],
)
def test_only_what_is_commanded_is_drawn(drawn, command, count):
    assert len(arrows(drawn(command=command))) == count


def test_colours_tell_the_thrust_from_the_commanded_one_and_the_paths_apart(drawn):
    shown = drawn(command=COMMAND, times=range(0, 5 * STEP_NS, STEP_NS))
    colours = {arrow.color for arrow in arrows(shown)}
    ((paths,),) = shown["/paths"]
    colours |= {line.color for line in paths.lines}
    assert len(colours) == 4
    assert all(len(colour) == 4 for colour in colours)


def test_the_body_is_drawn_once_in_ten_times_and_the_paths_twice(drawn):
    shown = drawn(command=COMMAND, times=range(0, 20 * STEP_NS, STEP_NS))
    assert len(shown["/scene"]) == 20
    with_body = [
        number
        for number, entities in enumerate(shown["/scene"])
        if "body" in [entity.name for entity in entities]
    ]
    assert with_body == [0, 10]
    body = shown["/scene"][0][0]
    assert (body.frame, body.follows_frame, len(body.cubes), len(body.cylinders)) == (
        "vehicle",
        True,
        1,
        4,
    )
    assert np.sum([rotor.pose[:2] for rotor in body.cylinders], axis=0) == pytest.approx((0.0, 0.0))
    assert len(shown["/paths"]) == 4


def test_paths_are_in_the_world_and_start_anew_after_a_pause(drawn):
    shown = drawn(times=range(0, 10 * STEP_NS, STEP_NS))
    ((paths,), _) = shown["/paths"]
    assert (paths.name, paths.frame, paths.follows_frame) == ("paths", "world", False)
    reference, flown = (list(line.points) for line in paths.lines)
    assert reference == [(4.0, 5.0, 6.0)] * 5  # every second place
    assert flown == [(1.0, 2.0, 3.0)] * 5
    later = 9 * STEP_NS + 1_000_000_001
    times = range(later, later + 5 * STEP_NS, STEP_NS)
    shown = drawn(times=times, position=(7.0, 8.0, 9.0))
    (paths,) = shown["/paths"][-1]
    assert {tuple(point) for point in paths.lines[1].points} == {(7.0, 8.0, 9.0)}


def test_a_pause_of_a_second_keeps_the_paths(drawn):
    drawn(times=range(0, 10 * STEP_NS, STEP_NS))
    times = range(9 * STEP_NS + 1_000_000_000, 14 * STEP_NS + 1_000_000_000, STEP_NS)
    (paths,) = drawn(times=times, position=(7.0, 8.0, 9.0))["/paths"][-1]
    assert {tuple(point) for point in paths.lines[1].points} == {(1.0, 2.0, 3.0), (7.0, 8.0, 9.0)}
