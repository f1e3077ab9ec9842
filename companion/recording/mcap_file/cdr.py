"""Messages in CDR (ROS 2) that are not only numbers, and the Foxglove types of poses and events.

Foxglove, Lichtblick and PlotJuggler recognise these types by name and draw them.
"""

import struct

from companion.recording.mcap_file.fields import CDR_HEADER, PACKAGE, MessageType

_STAMP = struct.Struct("<iI")
_UINT32 = struct.Struct("<I")
_NANOSECONDS = 1_000_000_000

_TIME = """MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
_QUATERNION = """MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
"""
_VECTOR = """MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
"""
_POINT = _VECTOR.replace("Vector3", "Point")
_POSE_TYPE = """MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
"""
GEOMETRY = (_TIME, _QUATERNION, _VECTOR, _POINT, _POSE_TYPE)
"""Definitions of the types of time and geometry."""
_SEPARATOR = "=" * 80 + "\n"


def message_type(name: str, *parts: str) -> MessageType:
    """A message type from its own fields and the definitions of the types in it."""
    return MessageType(name, _SEPARATOR.join(parts).encode())


FRAME_TRANSFORM = message_type(
    "foxglove_msgs/msg/FrameTransform",
    "builtin_interfaces/Time timestamp\nstring parent_frame_id\nstring child_frame_id\n"
    "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n",
    _TIME,
    _VECTOR,
    _QUATERNION,
)
POSE_IN_FRAME = message_type(
    "foxglove_msgs/msg/PoseInFrame",
    "builtin_interfaces/Time timestamp\nstring frame_id\ngeometry_msgs/Pose pose\n",
    _TIME,
    _POSE_TYPE,
    _POINT,
    _QUATERNION,
)
LOG = message_type(
    "foxglove_msgs/msg/Log",
    "uint8 UNKNOWN=0\nuint8 DEBUG=1\nuint8 INFO=2\nuint8 WARNING=3\nuint8 ERROR=4\nuint8 FATAL=5\n"
    "builtin_interfaces/Time timestamp\nuint8 level\nstring message\nstring name\nstring file\n"
    "uint32 line\n",
    _TIME,
)
PHASE = message_type(
    f"{PACKAGE}/Phase",
    "# A phase of the flight began.\n# Time on our clock, s.\nfloat64 time_s\nstring name\n"
    "# The condition that ends the phase.\nstring waits_for\n",
)
MANEUVER = message_type(
    f"{PACKAGE}/Maneuver",
    "# A maneuver began; an empty name: the last one ended.\n# Time on our clock, s.\n"
    "float64 time_s\n# Time on the vehicle's clock, s.\nfloat64 vehicle_time_s\nstring name\n",
)
ALARM = message_type(
    f"{PACKAGE}/Alarm",
    "# A safety monitor raised its alarm, or its alarm is over.\n# Time on our clock, s.\n"
    "float64 time_s\n# 1: raised, 0: over.\nfloat64 raised\nstring monitor\nstring reason\n"
    "# What the flight does about it.\nstring action\n",
)
CHANGE = message_type(
    f"{PACKAGE}/Change",
    "# Values of the configuration begin to change in flight.\n# Time on our clock, s.\n"
    "float64 time_s\n# 1: at once, 0: slewed.\nfloat64 at_once\n"
    "# The new values as JSON, by section and key.\nstring values\n",
)
Pose = tuple[float, float, float, float, float, float, float]
"""Position x, y, z (m), and orientation as a quaternion x, y, z, w."""


class CdrMessage:
    """Builds a CDR message.

    Each value begins at a multiple of its size, counted in bytes from the end of the header.
    """

    def __init__(self) -> None:
        self._bytes = bytearray(CDR_HEADER)

    def bytes(self) -> bytes:
        """The message so far."""
        return bytes(self._bytes)

    def align(self, size: int) -> None:
        """Pad to a multiple of `size` bytes."""
        self._bytes += bytes(-(len(self._bytes) - len(CDR_HEADER)) % size)

    def add_uint8(self, value: int) -> None:
        """Add a uint8."""
        self._bytes.append(value)

    def add_uint32(self, number: int) -> None:
        """Add a uint32, such as the length of a list."""
        self.align(4)
        self._bytes += _UINT32.pack(number)

    def add_time(self, time_ns: int) -> None:
        """Add a time in ns since 1970, as `builtin_interfaces/Time`."""
        self.align(4)
        self._bytes += _STAMP.pack(*divmod(time_ns, _NANOSECONDS))

    def add_doubles(self, *values: float) -> None:
        """Add float64 values."""
        self.align(8)
        self._bytes += struct.pack(f"<{len(values)}d", *values)

    def add_text(self, text: str) -> None:
        """Add a string, with its length in front and a zero at its end."""
        encoded = text.encode("utf-8", "replace") + b"\0"
        self.add_uint32(len(encoded))
        self._bytes += encoded


def fields_message(numbers: tuple[float, ...], texts: tuple[str, ...]) -> bytes:
    """Encode float64 fields followed by strings, the form of PHASE, MANEUVER, ALARM and CHANGE."""
    message = CdrMessage()
    message.add_doubles(*numbers)
    for text in texts:
        message.add_text(text)
    return message.bytes()


def fields_of(
    message: bytes, number_count: int, text_count: int
) -> tuple[tuple[float, ...], list[str]]:
    """Decode a message of `fields_message`: the numbers and the strings.

    Raises:
        ValueError: the message does not have this form.
    """
    try:
        values = struct.unpack_from(f"<{number_count}d", message, 4)
        offset, strings = 4 + 8 * number_count, []
        for _ in range(text_count):
            text, offset = _string(message, offset)
            strings.append(text)
    except struct.error as error:
        raise ValueError(f"a message is too short: {error}") from error
    return values, strings


def log_message(time_ns: int, level: int, text: str, name: str) -> bytes:
    """Encode a message of type LOG at a time in ns since 1970."""
    message = CdrMessage()
    message.add_time(time_ns)
    message.add_uint8(level)
    for each in (text, name, ""):  # "": no source file
        message.add_text(each)
    message.add_uint32(0)  # no source line
    return message.bytes()


def log_of(message: bytes) -> tuple[int, str, str]:
    """Decode level, text and name of a message of type LOG.

    Raises:
        ValueError: the message does not have this form.
    """
    try:
        text, offset = _string(message, 13)
        name, _ = _string(message, offset)
        return message[12], text, name
    except (struct.error, IndexError) as error:
        raise ValueError(f"a log message is too short: {error}") from error


def pose_message(time_ns: int, pose: Pose, *frames: str) -> bytes:
    """Encode a message of type FRAME_TRANSFORM (two frames) or POSE_IN_FRAME (one frame)."""
    message = CdrMessage()
    message.add_time(time_ns)
    for frame in frames:
        message.add_text(frame)
    message.add_doubles(*pose)
    return message.bytes()


def _string(message: bytes, offset: int) -> tuple[str, int]:
    offset += -offset % 4
    (length,) = _UINT32.unpack_from(message, offset)
    begin, end = offset + 4, offset + 4 + length
    if not 1 <= length <= len(message) - begin:
        raise ValueError(f"a string of {length} bytes in a message of {len(message)}")
    return message[begin : end - 1].decode("utf-8", "replace"), end
