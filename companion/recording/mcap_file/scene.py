"""Drawings in 3D: encodes the type `foxglove_msgs/msg/SceneUpdate`.

An entity stays until another one with the same id replaces it on the same topic.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeVar

from companion.recording.mcap_file import cdr
from companion.recording.mcap_file.cdr import CdrMessage, Pose

T = TypeVar("T")
Color = tuple[float, float, float, float]
"""Red, green, blue and opacity, 0..1."""
AT_ORIGIN: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


class Arrow(NamedTuple):
    """An arrow along the x axis of its pose; lengths and diameters in m."""

    pose: Pose
    shaft_length: float
    shaft_diameter: float
    head_length: float
    head_diameter: float
    color: Color


class Cube(NamedTuple):
    """A box about its pose; its size along x, y and z in m."""

    pose: Pose
    size: tuple[float, float, float]
    color: Color


class Cylinder(NamedTuple):
    """A cylinder about its pose, along z; its size along x, y and z in m."""

    pose: Pose
    size: tuple[float, float, float]
    color: Color


class Line(NamedTuple):
    """A line, 2 pixels thick."""

    points: Sequence[tuple[float, float, float]]
    """(x, y, z) of each point, m."""
    color: Color
    separate_pairs: bool = False
    """True: each pair of points is a separate line. False: all points form one line."""


class Entity(NamedTuple):
    """Shapes that are replaced together."""

    name: str
    frame: str
    follows: bool = False
    """Whether the shapes move with `frame` until they are replaced."""
    arrows: Sequence[Arrow] = ()
    cubes: Sequence[Cube] = ()
    cylinders: Sequence[Cylinder] = ()
    lines: Sequence[Line] = ()


def scene_message(time_ns: int, entities: Sequence[Entity]) -> bytes:
    """Encode a message of type SCENE_UPDATE at a time in ns since 1970."""
    message = CdrMessage()
    message.count(0)  # deletions
    _each(message, entities, lambda entity: _entity(message, time_ns, entity))
    return message.bytes()


def _each(message: CdrMessage, items: Sequence[T], add: Callable[[T], None]) -> None:
    """Add a list: its length, and each item."""
    message.count(len(items))
    for item in items:
        add(item)


def _entity(message: CdrMessage, time_ns: int, entity: Entity) -> None:
    def arrow(one: Arrow) -> None:
        message.doubles(*one.pose, *one[1:5], *one.color)

    def box(one: Cube | Cylinder) -> None:
        scales = () if isinstance(one, Cube) else (1.0, 1.0)
        message.doubles(*one.pose, *one.size, *scales, *one.color)

    def line(one: Line) -> None:
        message.uint8(_LINE_LIST if one.separate_pairs else _LINE_STRIP)
        message.doubles(*AT_ORIGIN, _THICKNESS)
        message.uint8(_IN_PIXELS)
        message.count(len(one.points))
        if one.points:
            message.doubles(*(value for point in one.points for value in point))
        message.doubles(*one.color)
        for _ in ("colors", "indices"):
            message.count(0)

    message.time(time_ns)
    message.text(entity.frame)
    message.text(entity.name)
    message.time(0)  # lifetime: until it is replaced
    message.uint8(entity.follows)
    message.count(0)  # metadata
    _each(message, entity.arrows, arrow)
    _each(message, entity.cubes, box)
    message.count(0)  # spheres
    _each(message, entity.cylinders, box)
    _each(message, entity.lines, line)
    for _ in ("triangles", "texts", "models"):
        message.count(0)


_LINE_STRIP, _LINE_LIST, _IN_PIXELS, _THICKNESS = 0, 2, 1, 2.0
_POSE, _COLOR = "geometry_msgs/Pose pose\n", "foxglove_msgs/Color color\n"
_SIZE = "geometry_msgs/Vector3 size\n"
_POINTS = f"geometry_msgs/Point[] points\n{_COLOR}foxglove_msgs/Color[] colors\nuint32[] indices\n"
_PARTS = {
    "SceneEntityDeletion": "uint8 MATCHING_ID=0\nuint8 ALL=1\n"
    "builtin_interfaces/Time timestamp\nuint8 type\nstring id\n",
    "SceneEntity": "builtin_interfaces/Time timestamp\nstring frame_id\nstring id\n"
    "builtin_interfaces/Duration lifetime\nbool frame_locked\n"
    "foxglove_msgs/KeyValuePair[] metadata\nfoxglove_msgs/ArrowPrimitive[] arrows\n"
    "foxglove_msgs/CubePrimitive[] cubes\nfoxglove_msgs/SpherePrimitive[] spheres\n"
    "foxglove_msgs/CylinderPrimitive[] cylinders\nfoxglove_msgs/LinePrimitive[] lines\n"
    "foxglove_msgs/TriangleListPrimitive[] triangles\nfoxglove_msgs/TextPrimitive[] texts\n"
    "foxglove_msgs/ModelPrimitive[] models\n",
    "KeyValuePair": "string key\nstring value\n",
    "Color": "float64 r\nfloat64 g\nfloat64 b\nfloat64 a\n",
    "ArrowPrimitive": f"{_POSE}float64 shaft_length\nfloat64 shaft_diameter\n"
    f"float64 head_length\nfloat64 head_diameter\n{_COLOR}",
    "CubePrimitive": _POSE + _SIZE + _COLOR,
    "SpherePrimitive": _POSE + _SIZE + _COLOR,
    "CylinderPrimitive": f"{_POSE}{_SIZE}float64 bottom_scale\nfloat64 top_scale\n{_COLOR}",
    "LinePrimitive": "uint8 LINE_STRIP=0\nuint8 LINE_LOOP=1\nuint8 LINE_LIST=2\n"
    f"uint8 type\n{_POSE}float64 thickness\nbool scale_invariant\n{_POINTS}",
    "TriangleListPrimitive": _POSE + _POINTS,
    "TextPrimitive": f"{_POSE}bool billboard\nfloat64 font_size\nbool scale_invariant\n{_COLOR}"
    "string text\n",
    "ModelPrimitive": f"{_POSE}geometry_msgs/Vector3 scale\n{_COLOR}bool override_color\n"
    "string url\nstring media_type\nuint8[] data\n",
}
SCENE_UPDATE = cdr.message_type(
    "foxglove_msgs/msg/SceneUpdate",
    "foxglove_msgs/SceneEntityDeletion[] deletions\nfoxglove_msgs/SceneEntity[] entities\n",
    *(f"MSG: foxglove_msgs/{name}\n{fields}" for name, fields in _PARTS.items()),
    "MSG: builtin_interfaces/Duration\nint32 sec\nuint32 nanosec\n",
    *cdr.GEOMETRY,
)
