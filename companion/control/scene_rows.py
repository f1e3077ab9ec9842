"""The vehicle as 3D viewers draw it: body, thrust, commanded thrust, and paths of the last 20 s.

The frame of paths is x east, y north, z up (ENU); the frame of the vehicle's parts is x forward, y
left, z up (FLU).
"""

from collections import deque
from math import sqrt

from companion.attitude import Quaternion
from companion.attitude.kinematics import cos_tilt
from companion.attitude.rotation import attitude_of, body_error
from companion.control.guidance_command import GuidanceCommand
from companion.guidance.reference import GRAVITY, Vector
from companion.recording.mcap_file.cdr import Pose
from companion.recording.mcap_file.scene import (
    Arrow,
    Color,
    Cube,
    Cylinder,
    Entity,
    Line,
    scene_message,
)
from companion.recording.mcap_file.writer import McapWriter

_SQRT_HALF = sqrt(0.5)
_MAX_PATH_POINTS = 100
"""Number of points in a path: 20 s with guidance at 50 Hz."""
_DRAWINGS_PER_POINT, _DRAWINGS_PER_PATHS, _DRAWINGS_PER_BODY = 2, 5, 10
"""Each 2nd drawing adds a point to the paths, each 5th sends the paths, each 10th sends the body.
With guidance at 50 Hz there are ten drawings a second; each sends the thrust arrows. Paths and body
are repeated, because a viewer may join late or jump in the recording."""
_LONGEST_PAUSE_NS = 1_000_000_000
"""Longest pause between two drawings within one path, ns; after a longer one, new paths begin."""
_METRES_PER_M_S2 = 0.1
"""Length of a thrust arrow, m per m/s²."""
_LEAST_COS_TILT = 0.2
"""Lower bound of cos(tilt) in the length of an arrow."""
_GREY_COLOR: Color = (0.25, 0.25, 0.28, 1.0)
_FRONT_COLOR: Color = (0.85, 0.35, 0.1, 0.8)
_BACK_COLOR: Color = (0.3, 0.3, 0.35, 0.8)
_THRUST_COLOR: Color = (0.1, 0.7, 0.3, 1.0)
_COMMANDED_THRUST_COLOR: Color = (0.85, 0.2, 0.75, 0.7)
_FLOWN_PATH_COLOR: Color = (0.1, 0.5, 0.95, 1.0)
_REFERENCE_PATH_COLOR: Color = (0.95, 0.65, 0.1, 1.0)
_ROTOR_DISTANCE = 0.18
"""Distance of a rotor from the axes of the body, m."""

_ROTORS = tuple(
    Cylinder(
        (x * _ROTOR_DISTANCE, y * _ROTOR_DISTANCE, 0.05, 0.0, 0.0, 0.0, 1.0),
        (0.22, 0.22, 0.02),
        _FRONT_COLOR if x > 0 else _BACK_COLOR,
    )
    for x in (1, -1)
    for y in (1, -1)
)
_BODY_ENTITY = Entity(
    "body",
    "vehicle",
    follows_frame=True,
    cubes=(Cube((0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0), (0.3, 0.16, 0.08), _GREY_COLOR),),
    cylinders=_ROTORS,
)


class SceneWriter:
    """Writes the channels `/scene` and `/paths`; runs in the recorder's thread."""

    def __init__(self) -> None:
        self._command: GuidanceCommand | None = None
        self._flown_path: deque[Vector] = deque(maxlen=_MAX_PATH_POINTS)
        self._reference_path: deque[Vector] = deque(maxlen=_MAX_PATH_POINTS)
        self._count = self._newest_ns = 0

    def note_command(self, command: GuidanceCommand) -> None:
        """Take a new command from guidance."""
        self._command = command

    def draw(
        self, writer: McapWriter, time_ns: int, q: Quaternion, position: Vector, reference: Vector
    ) -> None:
        """Draw the vehicle, and from time to time the paths.

        Args:
            writer: writer of the file.
            time_ns: ns since 1970, or since the vehicle's boot if the file is in vehicle time.
            q: attitude.
            position: position of the vehicle, m ENU.
            reference: position of the reference, m ENU.
        """
        thrust = Entity("thrust", "vehicle", follows_frame=True, arrows=self._arrows(q))
        scene = (thrust,) if self._count % _DRAWINGS_PER_BODY else (_BODY_ENTITY, thrust)
        writer.message("/scene", time_ns, scene_message(time_ns, scene))
        if time_ns - self._newest_ns > _LONGEST_PAUSE_NS:
            self._flown_path.clear()
            self._reference_path.clear()
        self._newest_ns = time_ns
        if self._count % _DRAWINGS_PER_POINT == 0:
            self._flown_path.append(position)
            self._reference_path.append(reference)
        self._count += 1
        if self._count % _DRAWINGS_PER_PATHS == 0:
            lines = (
                Line(self._reference_path, _REFERENCE_PATH_COLOR),
                Line(self._flown_path, _FLOWN_PATH_COLOR),
            )
            paths = (Entity("paths", "world", lines=lines),)
            writer.message("/paths", time_ns, scene_message(time_ns, paths))

    def _arrows(self, q: Quaternion) -> tuple[Arrow, ...]:
        """Arrows of the thrust along the body's axis, and of the thrust that guidance commands."""
        command = self._command
        if command is None or command.idle:
            return ()
        lift = GRAVITY - (command.acceleration_down if command.thrust is None else 0.0)
        arrows = [_arrow(q, q, lift, _THRUST_COLOR)]
        wanted_q = _wanted_attitude(command)
        if wanted_q is not None:
            arrows.append(_arrow(q, wanted_q, lift, _COMMANDED_THRUST_COLOR))
        return tuple(arrows)


def _wanted_attitude(command: GuidanceCommand) -> Quaternion | None:
    """An attitude with the commanded thrust direction; None if body rates are commanded."""
    north, east = command.target[:2]
    if command.body_rates is not None or not north * north + east * east < 1.0:
        return None
    return attitude_of(north, east, 0.0)


def _thrust_arrow_pose(rotation: Quaternion) -> Pose:
    """Pose (FLU) of an arrow along the thrust axis of a body that is rotated by `rotation` (FRD).

    The rotation of the arrow is `rotation` in FLU ⊗ (√½, 0, −√½, 0), which turns x upwards.
    """
    w, x, y, z = rotation
    return (
        0.0,
        0.0,
        0.08,
        _SQRT_HALF * (x - z),
        _SQRT_HALF * (-y - w),
        _SQRT_HALF * (-z - x),
        _SQRT_HALF * (w - y),
    )


def _arrow(q: Quaternion, thrust_attitude: Quaternion, lift: float, color: Color) -> Arrow:
    """An arrow along the thrust of `thrust_attitude`, in the frame of a vehicle of attitude `q`.

    The length of the arrow shows the specific thrust whose vertical part is `lift`, m/s².
    """
    cosine = max(cos_tilt(thrust_attitude[1], thrust_attitude[2]), _LEAST_COS_TILT)
    arrow_length = max(_METRES_PER_M_S2 * lift / cosine, 0.01)
    head_length = min(0.15, 0.4 * arrow_length)
    return Arrow(
        _thrust_arrow_pose(body_error(q, thrust_attitude)),
        arrow_length - head_length,
        0.03,
        head_length,
        0.07,
        color,
    )
