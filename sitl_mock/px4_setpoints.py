"""What an offboard setpoint message asks, by PX4's type-mask rules (measured, see README)."""

import math
import struct

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.quaternion import Vector
from sitl_mock.setpoints import (
    ACCELERATION_BITS,
    ATTITUDE_IGNORED,
    FORCE,
    POSITION_BITS,
    POSITION_YAW_RATE_IGNORED,
    ROLL_OR_PITCH_RATE_IGNORED,
    THROTTLE_IGNORED,
    THRUST_BODY,
    VELOCITY_BITS,
    YAW_IGNORED,
    YAW_RATE_IGNORED,
    AttitudeSetpoint,
    PositionSetpoint,
)
from sitl_mock.wire import Message

NAN = float("nan")

_THRUST_BODY_FIELD = struct.Struct("<3f")
_FULL_LENGTH = 51
_MAGIC_V2 = 0xFD
_BODY_FRAMES = (dialect.MAV_FRAME_BODY_NED, dialect.MAV_FRAME_BODY_FRD)


def attitude_setpoint(message: Message) -> AttitudeSetpoint | None:
    """Return what a SET_ATTITUDE_TARGET asks, or None when PX4 would not count it.

    Rates are not clipped; NaN and infinite ones hold the present rate, NaN thrust is none.
    """
    mask = message.type_mask
    if mask & THROTTLE_IGNORED:
        return None
    with_rates = not mask & ROLL_OR_PITCH_RATE_IGNORED
    with_attitude = not mask & ATTITUDE_IGNORED
    if not with_rates and not with_attitude:
        return None
    yaw_rate = NAN if mask & YAW_RATE_IGNORED else message.body_yaw_rate
    rates = (message.body_roll_rate, message.body_pitch_rate, yaw_rate) if with_rates else None
    w, x, y, z = message.q
    thrust = -_thrust_body_down(message) if mask & THRUST_BODY else message.thrust
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
    if mask & FORCE or not (in_body or message.coordinate_frame == dialect.MAV_FRAME_LOCAL_NED):
        return None
    position = _masked(mask, POSITION_BITS, (message.x, message.y, message.z))
    velocity = _masked(mask, VELOCITY_BITS, (message.vx, message.vy, message.vz))
    acceleration = _masked(mask, ACCELERATION_BITS, (message.afx, message.afy, message.afz))
    if in_body:
        position = (NAN, NAN, NAN)
    if all(map(math.isnan, (*position, *velocity, *acceleration))):
        return None
    return PositionSetpoint(
        position,
        velocity,
        acceleration,
        NAN if mask & YAW_IGNORED else message.yaw,
        NAN if mask & POSITION_YAW_RATE_IGNORED else message.yaw_rate,
        in_body,
    )


def _masked(mask: int, bits: tuple[int, int, int], values: Vector) -> Vector:
    x, y, z = (
        NAN if mask & bit or not math.isfinite(value) else value
        for bit, value in zip(bits, values, strict=True)
    )
    return (x, y, z)
