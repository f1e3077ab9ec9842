"""SET_POSITION_TARGET_LOCAL_NED and _GLOBAL_INT: masks and frames.

Sources: MAVLink common; "Offboard Mode" of the PX4 guide; "Copter Commands in Guided Mode" of
ArduPilot's developer wiki. The two autopilots differ in two points, so a position in
MAV_FRAME_BODY_NED is refused, and a yaw in a body frame is interpreted as by the vehicle's
autopilot.
"""

from math import hypot, isfinite, pi
from typing import NamedTuple

from companion.guidance.fence import LatLon, local_offset
from companion.guidance.reference import Vector, rotate
from companion.mavlink.messages import Message, dialect
from companion.serve.setpoints.request import (
    AxisDemand,
    MotionRequest,
    Origin,
    RefusedSetpoint,
    VehiclePose,
)

_POSITION_BITS, _VELOCITY_BITS, _ACCELERATION_BITS = (1, 2, 4), (8, 16, 32), (64, 128, 256)
_FORCE_BIT, _NO_YAW, _NO_YAW_RATE = 512, 1024, 2048
_NO_ACCELERATION = 64 | 128 | 256
_DEFINED_BITS = 4095
_HORIZONTAL_AXES, _VERTICAL_AXES = (0, 1), (2,)

_MAX_POSITION, _MAX_SPEED, _MAX_ACCELERATION, _MAX_YAW_RATE = 10_000.0, 100.0, 100.0, 20.0
"""Largest numbers that are accepted, m, m/s, m/s² and rad/s."""


class _Frame(NamedTuple):
    """A coordinate frame of SET_POSITION_TARGET_LOCAL_NED."""

    is_offset: bool
    """Whether positions are relative to the vehicle."""
    is_body: bool
    """Whether directions are relative to the vehicle's heading."""


_LOCAL_FRAMES = {
    dialect.MAV_FRAME_LOCAL_NED: _Frame(is_offset=False, is_body=False),
    dialect.MAV_FRAME_LOCAL_OFFSET_NED: _Frame(is_offset=True, is_body=False),
    dialect.MAV_FRAME_BODY_NED: _Frame(is_offset=False, is_body=True),
    dialect.MAV_FRAME_BODY_OFFSET_NED: _Frame(is_offset=True, is_body=True),
    dialect.MAV_FRAME_BODY_FRD: _Frame(is_offset=True, is_body=True),
}
_AMSL_FRAMES = dialect.MAV_FRAME_GLOBAL, dialect.MAV_FRAME_GLOBAL_INT
_ABOVE_HOME_FRAMES = (
    dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT,
    dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT,
)
_TERRAIN_FRAMES = dialect.MAV_FRAME_GLOBAL_TERRAIN_ALT, dialect.MAV_FRAME_GLOBAL_TERRAIN_ALT_INT


def decode_local_target(
    message: Message, pose: VehiclePose, *, body_yaw_is_relative: bool
) -> MotionRequest:
    """The command of a SET_POSITION_TARGET_LOCAL_NED.

    `body_yaw_is_relative`: whether a yaw in a body frame is relative to the present yaw
    (ArduPilot), not to north (PX4).

    Raises:
        RefusedSetpoint: the setpoint is contradictory, incomplete, not finite, too large, or of a
            kind that is not flown.
    """
    frame = _LOCAL_FRAMES.get(message.coordinate_frame)
    if frame is None:
        raise RefusedSetpoint(f"coordinate_frame {message.coordinate_frame} is not supported")
    position, velocity, acceleration = _groups(message, (message.x, message.y, message.z))
    is_body_ned = message.coordinate_frame == dialect.MAV_FRAME_BODY_NED
    if is_body_ned and any(value is not None for value in position):
        raise RefusedSetpoint("position in BODY_NED is ambiguous: use LOCAL_NED or BODY_OFFSET_NED")
    frame_yaw = pose.yaw if frame.is_body else 0.0
    frame_origin = pose.position_ned if frame.is_offset else (0.0, 0.0, 0.0)
    position = _shift(_rotate(position, frame_yaw), frame_origin)
    velocity, acceleration = _rotate(velocity, frame_yaw), _rotate(acceleration, frame_yaw)
    yaw, yaw_rate = _heading(message)
    if frame.is_body and body_yaw_is_relative and yaw is not None:
        yaw += pose.yaw
    return _make_request((position, velocity, acceleration), yaw, yaw_rate)


def decode_global_target(message: Message, pose: VehiclePose) -> MotionRequest:
    """The command of a SET_POSITION_TARGET_GLOBAL_INT.

    Raises:
        RefusedSetpoint: the setpoint is contradictory, incomplete, not finite, too large, or of a
            kind that is not flown; or the origin of the local frame is unknown.
    """
    frame = message.coordinate_frame
    if frame in _TERRAIN_FRAMES:
        raise RefusedSetpoint("the terrain is unknown: give a height above sea level or home")
    if frame not in (*_AMSL_FRAMES, *_ABOVE_HOME_FRAMES):
        raise RefusedSetpoint(f"coordinate_frame {frame} is not supported")
    position, velocity, acceleration = _groups(message, (0.0, 0.0, message.alt))
    if any(value is not None for value in position):
        if pose.origin is None:
            raise RefusedSetpoint("the vehicle's global position is not known yet")
        local = _to_local(message, pose.origin, above_home=frame in _ABOVE_HOME_FRAMES)
        position = tuple(
            None if used_values is None else value
            for used_values, value in zip(position, local, strict=True)
        )
    yaw, yaw_rate = _heading(message)
    return _make_request((position, velocity, acceleration), yaw, yaw_rate)


_Values = tuple[float | None, ...]


def _groups(message: Message, position: Vector) -> tuple[_Values, _Values, _Values]:
    """Position, velocity and acceleration; None for each number that the mask excludes."""
    mask = message.type_mask
    if mask & _FORCE_BIT and mask & _NO_ACCELERATION != _NO_ACCELERATION:
        raise RefusedSetpoint("forces are not supported: clear FORCE_SET")
    if mask & ~_DEFINED_BITS:
        raise RefusedSetpoint(f"type_mask {mask} has bits that mean nothing to a multirotor")
    velocity = message.vx, message.vy, message.vz
    acceleration = message.afx, message.afy, message.afz
    return (
        _used_values(mask, _POSITION_BITS, position, _MAX_POSITION, "position"),
        _used_values(mask, _VELOCITY_BITS, velocity, _MAX_SPEED, "velocity"),
        _used_values(mask, _ACCELERATION_BITS, acceleration, _MAX_ACCELERATION, "acceleration"),
    )


def _used_values(
    mask: int, bits: tuple[int, int, int], values: Vector, largest: float, name: str
) -> _Values:
    used_values = tuple(
        None if mask & bit else value for bit, value in zip(bits, values, strict=True)
    )
    for value in used_values:
        if value is not None and not (isfinite(value) and abs(value) <= largest):
            raise RefusedSetpoint(f"{name} is not finite or too large: {value:g}")
    if (used_values[0] is None) != (used_values[1] is None):
        raise RefusedSetpoint(f"{name} is incomplete: give both x and y, or neither")
    return used_values


def _heading(message: Message) -> tuple[float | None, float | None]:
    """Yaw, rad, and yaw rate, rad/s; None for what the mask excludes."""
    mask = message.type_mask
    yaw = None if mask & _NO_YAW else message.yaw
    rate = None if mask & _NO_YAW_RATE else message.yaw_rate
    if yaw is not None and not (isfinite(yaw) and abs(yaw) <= 4.0 * pi):
        raise RefusedSetpoint(f"yaw is not finite or too large: {yaw:g}")
    if rate is not None and not (isfinite(rate) and abs(rate) <= _MAX_YAW_RATE):
        raise RefusedSetpoint(f"yaw_rate is not finite or too large: {rate:g}")
    return yaw, rate


def _rotate(values: _Values, angle: float) -> _Values:
    north, east, down = values
    if north is None or east is None or angle == 0.0:
        return values
    return (*rotate(north, east, angle), down)


def _shift(values: _Values, offset: Vector) -> _Values:
    return tuple(
        None if value is None else value + part for value, part in zip(values, offset, strict=True)
    )


def _make_request(
    groups: tuple[_Values, _Values, _Values], yaw: float | None, yaw_rate: float | None
) -> MotionRequest:
    return MotionRequest(
        _make_demand(groups, _HORIZONTAL_AXES, "horizontal"),
        _make_demand(groups, _VERTICAL_AXES, "vertical"),
        yaw,
        yaw_rate,
    )


def _make_demand(
    groups: tuple[_Values, _Values, _Values], axes: tuple[int, ...], name: str
) -> AxisDemand:
    position, velocity, acceleration = (_complete_vector(values, axes) for values in groups)
    if position is velocity is acceleration is None:
        raise RefusedSetpoint(f"no {name} command: give a position, a velocity or an acceleration")
    if position is not None and velocity is None and acceleration is not None:
        raise RefusedSetpoint("a position with an acceleration also needs a velocity")
    if position is not None and hypot(*position) > _MAX_POSITION:
        raise RefusedSetpoint(
            f"the position is more than {_MAX_POSITION:g} m from the local origin"
        )
    return AxisDemand(position, velocity, acceleration)


def _complete_vector(values: _Values, axes: tuple[int, ...]) -> tuple[float, ...] | None:
    """The values of the given `axes`; None if one of them is not commanded."""
    commanded = tuple(value for value in (values[axis] for axis in axes) if value is not None)
    return commanded if len(commanded) == len(axes) else None


def _to_local(message: Message, origin: Origin, *, above_home: bool) -> Vector:
    """The commanded global position in the local frame, NED, m; the earth is taken as flat."""
    degrees_per_unit = 1e-7
    place = LatLon(message.lat_int * degrees_per_unit, message.lon_int * degrees_per_unit)
    north, east = local_offset(place, LatLon(origin.latitude, origin.longitude))
    zero_altitude = origin.home_altitude if above_home else 0.0
    return north, east, origin.altitude - zero_altitude - message.alt
