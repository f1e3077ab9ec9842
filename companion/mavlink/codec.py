"""Fast codecs of the control loop's and lockstep's messages, and of ODOMETRY's reset counter.

The control loop receives ATTITUDE_QUATERNION and sends SET_ATTITUDE_TARGET; lockstep uses
SYSTEM_TIME. pymavlink takes about 40 us for one message, because its checksum is computed in
Python; this code takes 2 us. Tests compare its results with those of pymavlink.
"""

import struct
from math import isfinite

from fastcrc import crc16

from companion.attitude.types import BodyRates, Quaternion
from companion.mavlink.errors import InvalidSetpoint
from companion.mavlink.framing import SIGNED_FLAG, V2_MAGIC
from companion.mavlink.messages import CRC_EXTRA

ATTITUDE_QUATERNION = 31
SYSTEM_TIME = 2
SET_ATTITUDE_TARGET = 82

IGNORE_ATTITUDE = 128
"""ATTITUDE_TARGET_TYPEMASK: obey all three rates and the thrust, ignore the quaternion.

No other mask is sent: with any other mask the autopilot chooses some of these values itself."""

_FLOAT32_MAX = 3.4028234663852886e38
_ATTITUDE_LAYOUT = struct.Struct("<I7f")
_ATTITUDE_BYTES = _ATTITUDE_LAYOUT.size
_RESET_COUNTER_OFFSET = struct.calcsize("<Q55fBB")
_SETPOINT_LAYOUT = struct.Struct("<BBBBBBBHB I4f3ff BBB")
_SETPOINT_PAYLOAD_BYTES = 39
_SETPOINT_CRC_EXTRA = CRC_EXTRA[SET_ATTITUDE_TARGET]


def decode_attitude(payload: bytes) -> tuple[int, Quaternion, BodyRates] | None:
    """Decode an ATTITUDE_QUATERNION payload.

    Returns:
        `time_boot_ms`, attitude (w, x, y, z), body rates in rad/s; None if a number is NaN or
        infinite.
    """
    if len(payload) < _ATTITUDE_BYTES:
        payload = payload.ljust(_ATTITUDE_BYTES, b"\0")
    time_boot_ms, w, x, y, z, roll, pitch, yaw = _ATTITUDE_LAYOUT.unpack_from(payload)
    # One test for all: the sum of seven float32 cannot overflow a double, so it is finite if and
    # only if all of them are.
    if not isfinite(w + x + y + z + roll + pitch + yaw):
        return None
    return time_boot_ms, (w, x, y, z), BodyRates(roll, pitch, yaw)


def decode_reset_counter(payload: bytes) -> int:
    """`reset_counter` of an ODOMETRY payload; 0 where an old autopilot does not send it."""
    return payload[_RESET_COUNTER_OFFSET] if len(payload) > _RESET_COUNTER_OFFSET else 0


class SetpointEncoder:
    """Builds SET_ATTITUDE_TARGET frames with body rates and thrust.

    It refuses rates that are not finite and a thrust outside 0..1. Measured on both autopilots: a
    NaN or negative thrust lets the vehicle fall, and an infinite rate makes it spin for ever.
    """

    def __init__(
        self,
        system: int,
        component: int,
        target_system: int,
        target_component: int,
        *,
        signed: bool,
    ) -> None:
        self._system, self._component = system, component
        self._target_system, self._target_component = target_system, target_component
        self._flags = SIGNED_FLAG if signed else 0

    def frame(self, sequence: int, time_boot_ms: int, rates: BodyRates, thrust: float) -> bytes:
        """Build one frame; with signing, the signature must be appended.

        Args:
            sequence: sequence number, 0..255.
            time_boot_ms: time stamp of the sample to which this setpoint responds, ms.
            rates: rad/s about body x, y, z (FRD).
            thrust: collective thrust, 0..1.

        Raises:
            InvalidSetpoint: a rate or the thrust is not finite as float32, the thrust is outside
                0..1, or the time stamp outside uint32.
        """
        roll, pitch, yaw = rates
        # Written so that NaN fails too: every comparison with it is false.
        if not (
            -_FLOAT32_MAX <= roll <= _FLOAT32_MAX
            and -_FLOAT32_MAX <= pitch <= _FLOAT32_MAX
            and -_FLOAT32_MAX <= yaw <= _FLOAT32_MAX
            and 0.0 <= thrust <= 1.0
            and 0 <= time_boot_ms <= 0xFFFFFFFF
        ):
            raise _refusal(time_boot_ms, rates, thrust)
        body = _SETPOINT_LAYOUT.pack(
            # header
            V2_MAGIC,
            _SETPOINT_PAYLOAD_BYTES,
            self._flags,
            0,
            sequence,
            self._system,
            self._component,
            SET_ATTITUDE_TARGET,
            0,
            # payload; the quaternion is ignored, and the identity is harmless
            time_boot_ms,
            1.0,
            0.0,
            0.0,
            0.0,
            roll,
            pitch,
            yaw,
            thrust,
            self._target_system,
            self._target_component,
            IGNORE_ATTITUDE,
        )
        return body + crc16.mcrf4xx(body[1:] + _SETPOINT_CRC_EXTRA).to_bytes(2, "little")


def _refusal(time_boot_ms: int, rates: BodyRates, thrust: float) -> InvalidSetpoint:
    if not all(isfinite(value) and abs(value) <= _FLOAT32_MAX for value in (*rates, thrust)):
        return InvalidSetpoint(
            f"setpoint not sent: rates {tuple(rates)} rad/s and thrust {thrust} must be finite"
        )
    if not 0.0 <= thrust <= 1.0:
        return InvalidSetpoint(f"setpoint not sent: thrust {thrust} is outside 0..1")
    return InvalidSetpoint(f"setpoint not sent: time_boot_ms {time_boot_ms} is outside uint32")


_SYSTEM_TIME_LAYOUT = struct.Struct("<QI")


def encode_system_time(time_boot_ms: int) -> bytes:
    """Payload of a SYSTEM_TIME without wall-clock time, which answers a lockstep beacon."""
    return _SYSTEM_TIME_LAYOUT.pack(0, time_boot_ms)


def decode_beacon(payload: bytes) -> int | None:
    """`time_boot_ms` of a lockstep beacon, a SYSTEM_TIME payload without wall-clock time.

    Returns:
        None for a SYSTEM_TIME with wall-clock time, which is no beacon.
    """
    padded = payload.ljust(_SYSTEM_TIME_LAYOUT.size, b"\0")
    fields: tuple[int, int] = _SYSTEM_TIME_LAYOUT.unpack_from(padded)
    unix_usec, time_boot_ms = fields
    return None if unix_usec else time_boot_ms
