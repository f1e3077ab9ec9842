"""SET_ATTITUDE_TARGET: an attitude or body rates, with thrust.

Sources: MAVLink common (ATTITUDE_TARGET_TYPEMASK); "Offboard Mode" of the PX4 guide; "Copter
Commands in Guided Mode" of ArduPilot's developer wiki. Both autopilots support two kinds: attitude
with thrust, and body rates with thrust. Under other masks the two autopilots act differently, or
not as the mask says (measured).
"""

from math import isfinite

from companion.attitude import AttitudeError, BodyRates
from companion.attitude.kinematics import cos_tilt
from companion.attitude.representation import normalised
from companion.mavlink.messages import Message
from companion.serve.setpoints.request import AttitudeRequest, RatesRequest, RefusedSetpoint

_NO_ROLL_RATE, _NO_PITCH_RATE, _NO_YAW_RATE = 1, 2, 4
_ALL_RATES = _NO_ROLL_RATE | _NO_PITCH_RATE | _NO_YAW_RATE
_THRUST_BODY, _NO_THRUST, _NO_ATTITUDE = 32, 64, 128
_RESERVED_BITS = 8 | 16
_LARGEST_RATE = 100.0
"""Largest body rate that is accepted, rad/s."""


def decode_attitude_target(message: Message) -> AttitudeRequest | RatesRequest:
    """The command of a SET_ATTITUDE_TARGET.

    Raises:
        RefusedSetpoint: the setpoint is contradictory, incomplete, not finite, too large, or of a
            kind that is not flown.
    """
    mask, thrust = message.type_mask, message.thrust
    if mask & _RESERVED_BITS:
        raise RefusedSetpoint(f"type_mask {mask} has reserved bits")
    if mask & _THRUST_BODY:
        raise RefusedSetpoint("thrust_body is not supported: give thrust, clear THRUST_BODY_SET")
    if mask & _NO_THRUST:
        raise RefusedSetpoint("thrust is missing: clear THROTTLE_IGNORE")
    if not 0.0 <= thrust <= 1.0:
        raise RefusedSetpoint(f"thrust is outside 0..1: {thrust:g}")
    ignored_rates = mask & _ALL_RATES
    if mask & _NO_ATTITUDE:
        if ignored_rates:
            raise RefusedSetpoint("body rates are incomplete: give roll, pitch and yaw rate")
        return RatesRequest(_rates(message), thrust)
    if ignored_rates & (_NO_ROLL_RATE | _NO_PITCH_RATE) != _NO_ROLL_RATE | _NO_PITCH_RATE:
        raise RefusedSetpoint(
            "attitude and body rates contradict each other: set the ignore bits of one"
        )
    return AttitudeRequest(
        _attitude(message),
        0.0 if ignored_rates & _NO_YAW_RATE else _rate(message.body_yaw_rate),
        thrust,
    )


def _rates(message: Message) -> BodyRates:
    return BodyRates(
        _rate(message.body_roll_rate), _rate(message.body_pitch_rate), _rate(message.body_yaw_rate)
    )


def _rate(rate: float) -> float:
    if not (isfinite(rate) and abs(rate) <= _LARGEST_RATE):
        raise RefusedSetpoint(f"a body rate is not finite or too large: {rate:g}")
    return rate


def _attitude(message: Message) -> tuple[float, float, float, float]:
    try:
        q = normalised(tuple(message.q))
    except AttitudeError as error:
        raise RefusedSetpoint("q is not a unit quaternion (w, x, y, z)") from error
    # Beyond 90 degrees, an attitude has the same acceleration coefficients as one below.
    if cos_tilt(q[1], q[2]) <= 0.0:
        raise RefusedSetpoint("an attitude beyond 90 degrees of tilt is not supported")
    return q
