"""Setpoints, rates and thrust of a recorded flight, in vehicle time, from a `.tlog`."""

from collections import deque
from dataclasses import dataclass, field
from pathlib import Path

from companion.guidance.reference import GRAVITY
from companion.mavlink.codec import IGNORE_ATTITUDE
from companion.mavlink.errors import LogError
from companion.mavlink.messages import Message, dialect
from companion.mavlink.tlog_file import messages
from companion.vehicle.autopilot import Autopilot, Role
from companion.vehicle.registry import AUTOPILOT_NAMES, AUTOPILOTS_BY_NUMBER

Row = tuple[float, ...]

_COMPARED_MASK_BITS = IGNORE_ATTITUDE | 0b1100111
"""Bits of a setpoint's type mask that are compared: quaternion, rates, throttle, body thrust."""
_RECENT_SAMPLE_COUNT = 500
"""Number of newest samples whose time stamp a setpoint may carry."""
_MAX_CLOCK_DIFFERENCE = 1.0
"""Stamps of accelerometer and attitude that differ by more than this, s, come from two clocks."""
_MESSAGE_NAMES = {
    "HEARTBEAT",
    "SET_ATTITUDE_TARGET",
    "ATTITUDE_QUATERNION",
    "ATTITUDE",
    "HIGHRES_IMU",
    "SCALED_IMU",
}


@dataclass(frozen=True, slots=True)
class FlightLog:
    """Setpoints and measurements of one flight; times are in s since the vehicle's boot."""

    setpoints: list[Row]
    """Setpoints that the autopilot obeyed: (time of the sample to which the setpoint responds,
    roll, pitch, yaw rate in rad/s, thrust 0..1)."""
    rates: list[Row]
    """Measured rates: (time, roll, pitch, yaw rate in rad/s)."""
    specific_thrust: list[Row]
    """The accelerometer's −z axis (body FRD): (time, m/s²)."""
    autopilot: str
    """Name of the autopilot, such as `PX4`."""
    damage: str | None = None
    """A sentence if damaged records of the log were left out; else None."""


def read_flight_log(path: Path | str) -> FlightLog:
    """Read a `.tlog` of this or another program.

    A setpoint of this program carries the time stamp of the sample to which it responds. A setpoint
    with another stamp is assigned to the latest sample recorded before it. A setpoint counts only
    if the heartbeats before and after it say that the vehicle is armed and obeys rates.

    Raises:
        LogError: the file cannot be read, is not a `.tlog`, or has no heartbeat of a supported
            autopilot, or no setpoint that the autopilot obeyed.
    """
    path, reader = Path(path), _Reader()
    damage: list[str] = []
    for frame, message in messages(path, _MESSAGE_NAMES, damage.append):
        reader.take((frame.system, frame.component), message)
    if reader.autopilot is None:
        raise LogError(f"{path}: holds no heartbeat of {AUTOPILOT_NAMES}")
    if not reader.obeyed_setpoints:
        raise LogError(
            f"{path}: holds no body rates that the vehicle obeyed: no SET_ATTITUDE_TARGET with "
            "body rates was sent while it was armed in the mode that obeys them"
        )
    # Both attitude messages carry the same rates, so only one of them is used.
    return FlightLog(
        reader.obeyed_setpoints,
        max(reader.rates_with_quaternion, reader.rates_with_euler, key=len),
        reader.specific_thrust,
        reader.autopilot.name,
        damage[0] if damage else None,
    )


@dataclass(slots=True)
class _Reader:
    """Collects setpoints and measurements from messages, taken in the order of their recording."""

    vehicle: tuple[int, int] | None = None
    """System and component of the autopilot, from its first heartbeat."""
    autopilot: Autopilot | None = None
    """The autopilot, by its first heartbeat."""
    obeyed_setpoints: list[Row] = field(default_factory=list)
    rates_with_quaternion: list[Row] = field(default_factory=list)
    """Body rates from ATTITUDE_QUATERNION."""
    rates_with_euler: list[Row] = field(default_factory=list)
    """Body rates from ATTITUDE."""
    specific_thrust: list[Row] = field(default_factory=list)
    """The accelerometer's −z axis; see `FlightLog.specific_thrust`."""
    _obeyed_at_last_heartbeat: bool = False
    _unconfirmed_setpoints: list[Row] = field(default_factory=list)
    _stamps_ms: deque[int] = field(default_factory=lambda: deque(maxlen=_RECENT_SAMPLE_COUNT))

    def take(self, source: tuple[int, int], message: Message) -> None:
        """Take one message from `source` (system, component)."""
        message_type = message.get_type()
        if message_type == "SET_ATTITUDE_TARGET":
            self._take_setpoint(message)
        elif message_type == "HEARTBEAT":
            self._take_heartbeat(source, message)
        elif source == self.vehicle:
            self._take_telemetry(message_type, message)

    def _take_heartbeat(self, source: tuple[int, int], heartbeat: Message) -> None:
        if self.vehicle is None and heartbeat.autopilot in AUTOPILOTS_BY_NUMBER:
            self.vehicle, self.autopilot = source, AUTOPILOTS_BY_NUMBER[heartbeat.autopilot]
        if source != self.vehicle or self.autopilot is None:
            return
        mode = self.autopilot.mode_name(heartbeat.base_mode, heartbeat.custom_mode)
        armed = bool(heartbeat.base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED)
        obeys_setpoints = armed and Role.OFFBOARD in self.autopilot.roles(mode)
        if obeys_setpoints and self._obeyed_at_last_heartbeat:
            self.obeyed_setpoints.extend(self._unconfirmed_setpoints)
        self._unconfirmed_setpoints.clear()
        self._obeyed_at_last_heartbeat = obeys_setpoints

    def _take_setpoint(self, setpoint: Message) -> None:
        if not self._stamps_ms or setpoint.type_mask & _COMPARED_MASK_BITS != IGNORE_ATTITUDE:
            return
        stamp_is_known = setpoint.time_boot_ms in self._stamps_ms
        stamp = setpoint.time_boot_ms if stamp_is_known else self._stamps_ms[-1]
        self._unconfirmed_setpoints.append(
            (
                1e-3 * stamp,
                setpoint.body_roll_rate,
                setpoint.body_pitch_rate,
                setpoint.body_yaw_rate,
                setpoint.thrust,
            )
        )

    def _take_telemetry(self, message_type: str, message: Message) -> None:
        if message_type == "HIGHRES_IMU":
            self._take_accelerometer(1e-6 * message.time_usec, -message.zacc)
        elif message_type == "SCALED_IMU":
            milli_g = -message.zacc
            self._take_accelerometer(1e-3 * message.time_boot_ms, 1e-3 * GRAVITY * milli_g)
        else:
            is_quaternion = message_type == "ATTITUDE_QUATERNION"
            rows = self.rates_with_quaternion if is_quaternion else self.rates_with_euler
            time = 1e-3 * message.time_boot_ms
            rows.append((time, message.rollspeed, message.pitchspeed, message.yawspeed))
            self._stamps_ms.append(message.time_boot_ms)

    def _take_accelerometer(self, time: float, specific_thrust: float) -> None:
        if self._stamps_ms and abs(time - 1e-3 * self._stamps_ms[-1]) < _MAX_CLOCK_DIFFERENCE:
            self.specific_thrust.append((time, specific_thrust))
