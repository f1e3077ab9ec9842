"""What an offboard setpoint asks, and the masks of the messages that carry it."""

from typing import NamedTuple

from sitl_mock.quaternion import Quaternion, Vector

ROLL_OR_PITCH_RATE_IGNORED = 1 | 2
YAW_RATE_IGNORED = 4
THRUST_BODY = 32
THROTTLE_IGNORED = 64
ATTITUDE_IGNORED = 128
"""ATTITUDE_TARGET_TYPEMASK of SET_ATTITUDE_TARGET."""

POSITION_BITS = (1, 2, 4)
VELOCITY_BITS = (8, 16, 32)
ACCELERATION_BITS = (64, 128, 256)
FORCE = 512
YAW_IGNORED = 1024
POSITION_YAW_RATE_IGNORED = 2048
"""POSITION_TARGET_TYPEMASK of SET_POSITION_TARGET_LOCAL_NED."""


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
