"""Decodes offboard setpoints by PX4's type-mask rules (docs/mock-vehicle.md)."""

import struct
from math import isnan, nan

from sitl_mock.autopilot.setpoints import (
    ATTITUDE_IGNORED,
    ROLL_OR_PITCH_RATE_IGNORED,
    THROTTLE_IGNORED,
    THRUST_BODY,
    YAW_RATE_IGNORED,
    AttitudeSetpoint,
    Setpoint,
    position_setpoint,
)
from sitl_mock.link.framing import Message

_THRUST_BODY_FIELD = struct.Struct("<3f")
_FULL_LENGTH = 51
"""Length of SET_ATTITUDE_TARGET with thrust_body, bytes."""
_MAGIC_V2 = 0xFD


def decode_setpoint(message: Message) -> Setpoint | None:
    """Decode a setpoint message; None if PX4 would ignore it."""
    if message.get_type() == "SET_ATTITUDE_TARGET":
        return attitude_setpoint(message)
    return position_setpoint(message)


def attitude_setpoint(message: Message) -> AttitudeSetpoint | None:
    """Decode a SET_ATTITUDE_TARGET; None if PX4 would ignore it.

    Rates are not limited. NaN and infinite rates hold the present rate; NaN thrust means none.
    """
    mask = message.type_mask
    if mask & THROTTLE_IGNORED:
        return None
    with_rates = not mask & ROLL_OR_PITCH_RATE_IGNORED
    with_attitude = not mask & ATTITUDE_IGNORED
    if not with_rates and not with_attitude:
        return None
    yaw_rate = nan if mask & YAW_RATE_IGNORED else message.body_yaw_rate
    rates = (message.body_roll_rate, message.body_pitch_rate, yaw_rate) if with_rates else None
    w, x, y, z = message.q
    thrust = -_thrust_body_down(message) if mask & THRUST_BODY else message.thrust
    return AttitudeSetpoint(
        (w, x, y, z) if with_attitude else None, rates, 0.0 if isnan(yaw_rate) else yaw_rate, thrust
    )


def _thrust_body_down(message: Message) -> float:
    """Return the down component of the field thrust_body, which the dialect lacks."""
    frame = message.get_msgbuf()
    payload = bytes(frame[10 : 10 + frame[1]]) if frame[0] == _MAGIC_V2 else b""
    return float(_THRUST_BODY_FIELD.unpack_from(payload.ljust(_FULL_LENGTH, b"\0"), 39)[2])
