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
    """A box centred at `pose`; `size` along x, y and z, m."""

    pose: Pose
    size: tuple[float, float, float]
    color: Color


class Cylinder(NamedTuple):
    """A cylinder centred at `pose`, with its axis along z; `size` along x, y and z, m."""

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
    follows_frame: bool = False
    """Whether the shapes move with `frame` until they are replaced."""
    arrows: Sequence[Arrow] = ()
    cubes: Sequence[Cube] = ()
    cylinders: Sequence[Cylinder] = ()
    lines: Sequence[Line] = ()


def scene_message(time_ns: int, entities: Sequence[Entity]) -> bytes:
    """Encode a message of type SCENE_UPDATE at a time in ns since 1970."""
    message = CdrMessage()
    message.add_uint32(0)  # deletions
    _add_list(message, entities, lambda entity: _add_entity(message, time_ns, entity))
    return message.bytes()


def _add_list(message: CdrMessage, items: Sequence[T], add: Callable[[T], None]) -> None:
    """Add a list: its length, and each item."""
    message.add_uint32(len(items))
    for item in items:
        add(item)


def _add_entity(message: CdrMessage, time_ns: int, entity: Entity) -> None:
    def add_arrow(shape: Arrow) -> None:
        message.add_doubles(*shape.pose, *shape[1:5], *shape.color)

    def add_box(shape: Cube | Cylinder) -> None:
        end_scales = () if isinstance(shape, Cube) else (1.0, 1.0)
        message.add_doubles(*shape.pose, *shape.size, *end_scales, *shape.color)

    def add_line(shape: Line) -> None:
        message.add_uint8(_LINE_LIST if shape.separate_pairs else _LINE_STRIP)
        message.add_doubles(*AT_ORIGIN, _THICKNESS)
        message.add_uint8(_IN_PIXELS)
        message.add_uint32(len(shape.points))
        if shape.points:
            message.add_doubles(*(value for point in shape.points for value in point))
        message.add_doubles(*shape.color)
        for _ in ("colors", "indices"):
            message.add_uint32(0)

    message.add_time(time_ns)
    message.add_text(entity.frame)
    message.add_text(entity.name)
    message.add_time(0)  # lifetime: until it is replaced
    message.add_uint8(entity.follows_frame)
    message.add_uint32(0)  # metadata
    _add_list(message, entity.arrows, add_arrow)
    _add_list(message, entity.cubes, add_box)
    message.add_uint32(0)  # spheres
    _add_list(message, entity.cylinders, add_box)
    _add_list(message, entity.lines, add_line)
    for _ in ("triangles", "texts", "models"):
        message.add_uint32(0)


_LINE_STRIP, _LINE_LIST, _IN_PIXELS, _THICKNESS = 0, 2, 1, 2.0
_POSE, _COLOR = "geometry_msgs/Pose pose\n", "foxglove_msgs/Color color\n"
_SIZE = "geometry_msgs/Vector3 size\n"
_POINTS = f"geometry_msgs/Point[] points\n{_COLOR}foxglove_msgs/Color[] colors\nuint32[] indices\n"
_TYPE_DEFINITIONS = {
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
    *(f"MSG: foxglove_msgs/{name}\n{fields}" for name, fields in _TYPE_DEFINITIONS.items()),
    "MSG: builtin_interfaces/Duration\nint32 sec\nuint32 nanosec\n",
    *cdr.GEOMETRY,
)
