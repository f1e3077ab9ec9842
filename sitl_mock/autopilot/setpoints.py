"""Offboard setpoints, the type masks of their messages, and the stream of setpoints."""

from math import isfinite, isnan, nan
from typing import NamedTuple

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.link.framing import Message
from sitl_mock.physics.quaternion import Quaternion, Vector

# Bits of type_mask in SET_ATTITUDE_TARGET.
ROLL_OR_PITCH_RATE_IGNORED = 1 | 2
YAW_RATE_IGNORED = 4
THRUST_BODY = 32
THROTTLE_IGNORED = 64
ATTITUDE_IGNORED = 128
# Bits of type_mask in SET_POSITION_TARGET_LOCAL_NED. A set bit ignores its axis; north first.
POSITION_BITS = (1, 2, 4)
VELOCITY_BITS = (8, 16, 32)
ACCELERATION_BITS = (64, 128, 256)
FORCE = 512
YAW_IGNORED = 1024
POSITION_YAW_RATE_IGNORED = 2048
_BODY_FRAMES = (dialect.MAV_FRAME_BODY_NED, dialect.MAV_FRAME_BODY_FRD)
LOSS_DETECTION_DELAY_US = 60_000
"""Delay beyond COM_OF_LOSS_T after which the loss of setpoints is noticed, us (measured: 60 to 110
ms)."""


class AttitudeSetpoint(NamedTuple):
    """Attitude and/or rates with thrust, from SET_ATTITUDE_TARGET.

    ``q`` None = no attitude control; ``rates`` (rad/s, body FRD) None = no body rates, NaN = hold
    the present rate; ``yaw_rate`` (rad/s) is the feed-forward of attitude control; ``thrust`` 0..1,
    NaN = none (with ArduPilot it may mean a climb rate, 0.5 = zero).
    """

    q: Quaternion | None
    rates: Vector | None
    yaw_rate: float
    thrust: float


class PositionSetpoint(NamedTuple):
    """Position, velocity, acceleration (NED, SI), yaw and yaw rate (rad); NaN = not controlled.

    ``in_body_heading``: horizontal components are forward and right, not north and east.
    """

    position: Vector
    velocity: Vector
    acceleration: Vector
    yaw: float
    yaw_rate: float
    in_body_heading: bool


Setpoint = AttitudeSetpoint | PositionSetpoint


def position_setpoint(message: Message) -> PositionSetpoint | None:
    """Decode a SET_POSITION_TARGET_LOCAL_NED; None if it controls nothing or is not supported.

    Supported are MAV_FRAME_LOCAL_NED, and MAV_FRAME_BODY_NED/_FRD for velocity and acceleration.
    Forces are not supported.
    """
    mask = message.type_mask
    in_body = message.coordinate_frame in _BODY_FRAMES
    if mask & FORCE or not (in_body or message.coordinate_frame == dialect.MAV_FRAME_LOCAL_NED):
        return None
    position = _masked(mask, POSITION_BITS, (message.x, message.y, message.z))
    velocity = _masked(mask, VELOCITY_BITS, (message.vx, message.vy, message.vz))
    acceleration = _masked(mask, ACCELERATION_BITS, (message.afx, message.afy, message.afz))
    if in_body:
        position = (nan, nan, nan)
    if all(map(isnan, (*position, *velocity, *acceleration))):
        return None
    return PositionSetpoint(
        position,
        velocity,
        acceleration,
        nan if mask & YAW_IGNORED else message.yaw,
        nan if mask & POSITION_YAW_RATE_IGNORED else message.yaw_rate,
        in_body,
    )


def _masked(mask: int, bits: tuple[int, int, int], values: Vector) -> Vector:
    x, y, z = (
        nan if mask & bit or not isfinite(value) else value
        for bit, value in zip(bits, values, strict=True)
    )
    return (x, y, z)


class OffboardStream:
    """The latest accepted setpoint.

    Attributes:
        setpoint: the setpoint; None before the first.
        setpoint_count: number of setpoints accepted so far.
        last_setpoint_us: vehicle time at which the latest was received, us; None before the first.
        is_fresh: whether a setpoint arrived since the last call of `take_fresh`.
    """

    def __init__(self) -> None:
        self.setpoint: Setpoint | None = None
        self.setpoint_count = 0
        self.last_setpoint_us: int | None = None
        self.is_fresh = False

    def accept(self, setpoint: Setpoint, now_us: int) -> None:
        """Accept a setpoint that was received at `now_us`; it replaces the one before."""
        self.setpoint = setpoint
        self.setpoint_count += 1
        self.last_setpoint_us = now_us
        self.is_fresh = True

    def take_fresh(self) -> bool:
        """Return whether a setpoint arrived since the last call."""
        is_fresh, self.is_fresh = self.is_fresh, False
        return is_fresh

    def alive(self, now_us: int, loss_s: float) -> bool:
        """Whether the latest setpoint is at most ``loss_s`` + `LOSS_DETECTION_DELAY_US` old.

        ``loss_s`` is COM_OF_LOSS_T.
        """
        if self.last_setpoint_us is None:
            return False
        return now_us - self.last_setpoint_us <= round(loss_s * 1e6) + LOSS_DETECTION_DELAY_US
