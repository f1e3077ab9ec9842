"""The data of a `.tlog` for a page, written by this program or another one."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from companion.attitude import coefficients
from companion.attitude.kinematics import tilt_angle
from companion.attitude.representation import is_unit
from companion.mavlink.errors import LogError
from companion.mavlink.messages import Message
from companion.mavlink.tlog_file import messages
from companion.recording.mcap_file.flight_events import Event
from companion.report.flight_data import Curve, FlightData, Floats, Span, spans
from companion.vehicle.flight_log import read_flight_log
from companion.vehicle.registry import AUTOPILOTS_BY_NUMBER

_MESSAGE_NAMES = frozenset(
    {"ATTITUDE_QUATERNION", "ATTITUDE", "LOCAL_POSITION_NED", "HEARTBEAT", "STATUSTEXT"}
)
_INFORMATION, _WARNING, _ERROR = 2, 3, 4
"""Values of `Event.level`."""
_MAV_ERROR, _MAV_WARNING = 3, 4
"""Values of MAV_SEVERITY: ERROR and WARNING."""


def logged_flight(path: Path) -> FlightData:
    """The flight in a `.tlog`. Times are relative to the autopilot's first attitude or position.

    Raises:
        LogError: the file cannot be read, is not a `.tlog`, or has no telemetry of an autopilot.
    """
    reader = _TelemetryReader()
    damage: list[str] = []
    for frame, message in messages(path, _MESSAGE_NAMES, damage.append):
        reader.add_message((frame.system, frame.component), message)
    if reader.vehicle is None or reader.start_time is None:
        raise LogError(f"{path}: has no telemetry of PX4 or ArduPilot")
    curves = {**reader.curves(), **_rates_and_thrust(path, reader.start_time)}
    return FlightData(
        name=path.name,
        fault=damage[0] if damage else None,
        curves={name: curve for name, curve in curves.items() if len(curve.time)},
        modes=reader.modes(),
        events=tuple(reader.events),
    )


class _TelemetryReader:
    """Collects the autopilot's telemetry from the messages of a log, in their order.

    Attributes:
        vehicle: system and component of the autopilot, from its first heartbeat.
        start_time: first time stamp of attitude or position, s since boot.
        events: the autopilot's texts.
    """

    def __init__(self) -> None:
        self.vehicle: tuple[int, int] | None = None
        self.start_time: float | None = None
        self.events: list[Event] = []
        self._now = 0.0  # time of the newest attitude or position, s since `start_time`
        self._attitudes: list[tuple[float, ...]] = []
        self._positions: list[tuple[float, ...]] = []
        self._tilts: list[tuple[float, float]] = []
        self._modes: list[tuple[float, str]] = []

    def add_message(self, source: tuple[int, int], message: Message) -> None:
        """Take one message from `source` (system, component)."""
        message_type = message.get_type()
        if message_type == "HEARTBEAT":
            self._note_heartbeat(source, message)
        elif source != self.vehicle:
            return
        elif message_type == "STATUSTEXT":
            self._note_text(message)
        elif message_type == "LOCAL_POSITION_NED":
            self._update_time(message)
            speed = np.linalg.norm((message.vx, message.vy, message.vz))
            position = message.x, message.y, -message.z
            self._positions.append((self._now, *position, float(speed)))
        else:
            self._update_time(message)
            self._note_attitude(message_type, message)

    def _note_heartbeat(self, source: tuple[int, int], heartbeat: Message) -> None:
        autopilot = AUTOPILOTS_BY_NUMBER.get(heartbeat.autopilot)
        if autopilot is None or self.vehicle not in (None, source):
            return
        self.vehicle = source
        mode = autopilot.mode_name(heartbeat.base_mode, heartbeat.custom_mode)
        if not self._modes or self._modes[-1][1] != mode:
            self._modes.append((self._now, mode))

    def _update_time(self, message: Message) -> None:
        time = 1e-3 * message.time_boot_ms
        if self.start_time is None:
            self.start_time = time
        self._now = time - self.start_time

    def _note_attitude(self, message_type: str, message: Message) -> None:
        if message_type == "ATTITUDE":
            tilt = np.arccos(np.cos(message.roll) * np.cos(message.pitch))
        else:
            q = message.q1, message.q2, message.q3, message.q4
            if not is_unit(q):
                return
            c = coefficients(q)
            self._attitudes.append((self._now, c.north, c.east))
            tilt = tilt_angle(message.q2, message.q3)
        self._tilts.append((self._now, float(np.degrees(tilt))))

    def _note_text(self, message: Message) -> None:
        severity = message.severity
        level = _INFORMATION
        if severity <= _MAV_WARNING:
            level = _ERROR if severity <= _MAV_ERROR else _WARNING
        self.events.append(Event(self._now, message.text, level, "autopilot"))

    def modes(self) -> tuple[Span, ...]:
        """The autopilot's modes, in order."""
        return spans(self._modes, self._now)

    def curves(self) -> dict[str, Curve]:
        """Attitude and position; see `FlightData.curves`."""
        positions, tilts = _array(self._positions, 5), _array(self._tilts, 2)
        tilt = (
            np.interp(positions[:, 0], *tilts.T) if len(tilts) else np.full(len(positions), np.nan)
        )
        motion = np.column_stack([positions[:, 3], positions[:, 4], tilt])
        attitudes = _array(self._attitudes, 3)
        return {
            "position": Curve(positions[:, 0], positions[:, 1:4]),
            "motion": Curve(positions[:, 0], motion),
            "coefficients": Curve(attitudes[:, 0], attitudes[:, 1:]),
        }


def _array(rows: Iterable[tuple[float, ...]], columns: int) -> Floats:
    return np.array(list(rows), dtype=float).reshape(-1, columns)


def _rates_and_thrust(path: Path, start_time: float) -> dict[str, Curve]:
    """Rates and thrust, if the log has setpoints that the autopilot obeyed; else empty."""
    try:
        log = read_flight_log(path)
    except LogError:
        return {}
    sent, rates = _array(log.setpoints, 5), _array(log.rates, 4)
    return {
        "commanded": Curve(sent[:, 0] - start_time, np.degrees(sent[:, 1:4])),
        "measured": Curve(rates[:, 0] - start_time, np.degrees(rates[:, 1:4])),
        "thrust": Curve(sent[:, 0] - start_time, sent[:, [4]]),
    }
