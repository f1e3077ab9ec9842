"""What an offboard setpoint message asks, by PX4's type-mask rules (measured, see README)."""

import math
import struct
from typing import NamedTuple

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.quaternion import Quaternion, Vector
from sitl_mock.wire import Message

NAN = float("nan")

_ROLL_OR_PITCH_RATE_IGNORED = 1 | 2
_YAW_RATE_IGNORED = 4
_THRUST_BODY = 32
_THROTTLE_IGNORED = 64
_ATTITUDE_IGNORED = 128
_THRUST_BODY_FIELD = struct.Struct("<3f")
_FULL_LENGTH = 51
_MAGIC_V2 = 0xFD

_POSITION_BITS = (1, 2, 4)
_VELOCITY_BITS = (8, 16, 32)
_ACCELERATION_BITS = (64, 128, 256)
_FORCE = 512
_YAW_IGNORED = 1024
_POSITION_YAW_RATE_IGNORED = 2048

_BODY_FRAMES = (dialect.MAV_FRAME_BODY_NED, dialect.MAV_FRAME_BODY_FRD)


class AttitudeSetpoint(NamedTuple):
    """Attitude and/or rates with thrust, as SET_ATTITUDE_TARGET carries them.

    ``q`` None = no attitude control; ``rates`` (rad/s, body FRD) None = none given, NaN = hold the
    present one; ``yaw_rate`` is the feed-forward of attitude control; thrust 0..1, NaN = none.
    """

    q: Quaternion | None
    rates: Vector | None
    yaw_rate: float
    thrust: float


class PositionSetpoint(NamedTuple):
    """Position, velocity, acceleration (NED, SI) and yaw; NaN = that one is free.

    ``in_body_heading``: the horizontal components are along the heading, not north and east.
    """

    position: Vector
    velocity: Vector
    acceleration: Vector
    yaw: float
    yaw_rate: float
    in_body_heading: bool


Setpoint = AttitudeSetpoint | PositionSetpoint


def attitude_setpoint(message: Message) -> AttitudeSetpoint | None:
    """Return what a SET_ATTITUDE_TARGET asks, or None when PX4 would not count it.

    Rates are not clipped; NaN and infinite ones hold the present rate, NaN thrust is none.
    """
    mask = message.type_mask
    if mask & _THROTTLE_IGNORED:
        return None
    with_rates = not mask & _ROLL_OR_PITCH_RATE_IGNORED
    with_attitude = not mask & _ATTITUDE_IGNORED
    if not with_rates and not with_attitude:
        return None
    yaw_rate = NAN if mask & _YAW_RATE_IGNORED else message.body_yaw_rate
    rates = (message.body_roll_rate, message.body_pitch_rate, yaw_rate) if with_rates else None
    w, x, y, z = message.q
    thrust = -_thrust_body_down(message) if mask & _THRUST_BODY else message.thrust
    return AttitudeSetpoint(
        (w, x, y, z) if with_attitude else None,
        rates,
        0.0 if math.isnan(yaw_rate) else yaw_rate,
        thrust,
    )


def _thrust_body_down(message: Message) -> float:
    """Return the down component of the extension field thrust_body, which the dialect lacks."""
    frame = message.get_msgbuf()
    payload = bytes(frame[10 : 10 + frame[1]]) if frame[0] == _MAGIC_V2 else b""
    return float(_THRUST_BODY_FIELD.unpack_from(payload.ljust(_FULL_LENGTH, b"\0"), 39)[2])


def position_setpoint(message: Message) -> PositionSetpoint | None:
    """Return what a SET_POSITION_TARGET_LOCAL_NED asks, or None when PX4 would not count it.

    Frames MAV_FRAME_LOCAL_NED, and MAV_FRAME_BODY_NED/_FRD for velocity and acceleration.
    """
    mask = message.type_mask
    in_body = message.coordinate_frame in _BODY_FRAMES
    if mask & _FORCE or not (in_body or message.coordinate_frame == dialect.MAV_FRAME_LOCAL_NED):
        return None
    position = _masked(mask, _POSITION_BITS, (message.x, message.y, message.z))
    velocity = _masked(mask, _VELOCITY_BITS, (message.vx, message.vy, message.vz))
    acceleration = _masked(mask, _ACCELERATION_BITS, (message.afx, message.afy, message.afz))
    if in_body:
        position = (NAN, NAN, NAN)
    if all(map(math.isnan, (*position, *velocity, *acceleration))):
        return None
    return PositionSetpoint(
        position,
        velocity,
        acceleration,
        NAN if mask & _YAW_IGNORED else message.yaw,
        NAN if mask & _POSITION_YAW_RATE_IGNORED else message.yaw_rate,
        in_body,
    )


def _masked(mask: int, bits: tuple[int, int, int], values: Vector) -> Vector:
    x, y, z = (
        NAN if mask & bit or not math.isfinite(value) else value
        for bit, value in zip(bits, values, strict=True)
    )
    return (x, y, z)
