"""What a SET_ATTITUDE_TARGET asks of ArduCopter in GUIDED, by its type-mask rules (measured)."""

from math import isnan

from sitl_mock.autopilot.setpoints import (
    ATTITUDE_IGNORED,
    ROLL_OR_PITCH_RATE_IGNORED,
    THROTTLE_IGNORED,
    YAW_RATE_IGNORED,
    AttitudeSetpoint,
)
from sitl_mock.link.framing import Message

_ALL_RATES_IGNORED = ROLL_OR_PITCH_RATE_IGNORED | YAW_RATE_IGNORED
_UNIT_LENGTH_TOLERANCE = 1e-3


class FatalSetpointError(Exception):
    """A setpoint that ends ArduPilot's process: a quaternion of NaN, in use (measured: SIGFPE)."""


def attitude_setpoint(message: Message) -> AttitudeSetpoint | None:
    """Return what is asked; None: it cannot be flown, and the vehicle holds its position instead.

    The latter with the throttle ignored, with only some of the rates ignored, and with an attitude
    that is not of unit length. Rates may be NaN or infinite; thrust is as it came.

    Raises:
        FatalSetpointError: the attitude asked has a NaN.
    """
    mask = message.type_mask
    ignored = mask & _ALL_RATES_IGNORED
    if mask & THROTTLE_IGNORED or ignored not in (0, _ALL_RATES_IGNORED):
        return None
    rates = (message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate)
    rates = (0.0, 0.0, 0.0) if ignored else rates
    if mask & ATTITUDE_IGNORED:
        return AttitudeSetpoint(None, rates, rates[2], message.thrust)
    w, x, y, z = message.q
    square = w * w + x * x + y * y + z * z
    if isnan(square):
        raise FatalSetpointError
    if abs(square - 1.0) > _UNIT_LENGTH_TOLERANCE:
        return None
    return AttitudeSetpoint((w, x, y, z), rates, rates[2], message.thrust)
