"""Drawings in 3D: what is encoded is decoded by its schema, and Foxglove knows that schema."""

import re

import pytest
from mcap_ros2._dynamic import generate_dynamic

from companion.recording.mcap_file.scene import (
    SCENE_UPDATE,
    Arrow,
    Cube,
    Cylinder,
    Entity,
    Line,
    scene_message,
)

POSE = (1.0, 2.0, 3.0, 0.1, 0.2, 0.3, 0.9)
RED = (1.0, 0.0, 0.0, 0.5)
GREEN = (0.0, 1.0, 0.0, 1.0)
POINTS = [(0.0, 1.0, 2.0), (3.0, 4.0, 5.0), (6.0, 7.0, 8.0)]
SCENE = (
    Entity(
        "first one", "vehicle", follows_frame=True, arrows=[Arrow(POSE, 1.0, 0.1, 0.2, 0.3, RED)]
    ),
    Entity(
        "b",
        "world",
        cubes=[Cube(POSE, (1.0, 2.0, 3.0), GREEN)],
        cylinders=[Cylinder(POSE, (4.0, 5.0, 6.0), RED)] * 2,
        lines=[Line(POINTS, GREEN), Line((), RED), Line(POINTS[:2], RED, separate_pairs=True)],
    ),
)


def decoded(message):
    return generate_dynamic(SCENE_UPDATE.name, SCENE_UPDATE.schema.decode())[SCENE_UPDATE.name](
        message
    )


def pose_of(shape):
    place, turn = shape.pose.position, shape.pose.orientation
    return place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w


def color_of(shape):
    return shape.color.r, shape.color.g, shape.color.b, shape.color.a


def size_of(shape):
    return shape.size.x, shape.size.y, shape.size.z


def test_all_shapes_are_decoded_as_they_were_drawn():
    scene = decoded(scene_message(5_000_000_007, SCENE))
    assert scene.deletions == []
    first, second = scene.entities
    assert (first.id, first.frame_id, first.frame_locked) == ("first one", "vehicle", True)
    assert (first.timestamp.sec, first.timestamp.nanosec) == (5, 7)
    assert (first.lifetime.sec, first.lifetime.nanosec) == (0, 0)
    (arrow,) = first.arrows
    assert pose_of(arrow) == POSE
    lengths = arrow.shaft_length, arrow.shaft_diameter, arrow.head_length, arrow.head_diameter
    assert (*lengths, color_of(arrow)) == (1.0, 0.1, 0.2, 0.3, RED)

    assert (second.id, second.frame_id, second.frame_locked) == ("b", "world", False)
    (cube,) = second.cubes
    assert (pose_of(cube), size_of(cube), color_of(cube)) == (POSE, (1.0, 2.0, 3.0), GREEN)
    for cylinder in second.cylinders:
        assert (pose_of(cylinder), size_of(cylinder)) == (POSE, (4.0, 5.0, 6.0))
        assert (cylinder.bottom_scale, cylinder.top_scale, color_of(cylinder)) == (1.0, 1.0, RED)
    strip, empty, pairs = second.lines
    assert [(each.x, each.y, each.z) for each in strip.points] == POINTS
    assert (strip.type, strip.thickness, strip.scale_invariant) == (0, 2.0, True)
    assert color_of(strip) == GREEN
    assert (empty.points, color_of(empty)) == ([], RED)
    assert (pairs.type, len(pairs.points)) == (2, 2)
    assert second.spheres == second.triangles == second.texts == second.models == []


def test_the_schema_has_the_fields_of_foxglove_in_their_order():
    messages = pytest.importorskip("foxglove.messages")
    descriptors = pytest.importorskip("google.protobuf.descriptor_pb2")
    files = descriptors.FileDescriptorSet.FromString(messages.SceneUpdate.get_schema().data)
    theirs = {
        message.name: [field.name for field in message.field]
        for file in files.file
        if file.package == "foxglove"
        for message in file.message_type
    }
    theirs["Point"] = theirs.pop("Point3")
    ours, name = {}, "SceneUpdate"
    for line in SCENE_UPDATE.schema.decode().splitlines():
        if line.startswith("MSG: "):
            name = line.rpartition("/")[2]
        elif found := re.fullmatch(r"[\w/\[\]]+ (\w+)", line):
            ours.setdefault(name, []).append(found[1])
    for own in ("Time", "Duration"):
        del ours[own]
    for known in ("SceneEntityDeletion", "LinePrimitive"):  # the order of these does not matter
        ours[known].sort()
        theirs[known].sort()
    assert ours == theirs
