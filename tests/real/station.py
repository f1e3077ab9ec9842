"""A ground station on a second link, with a pilot's commands, and what it sees."""

import struct
import threading
import time
from math import acos, cos, degrees, hypot, inf
from typing import NamedTuple

from pymavlink import mavutil

from tests.real.build import Build
from tests.real.hil_truth import HilTruth
from tests.real.modes import ARDUPILOT_MODES, PX4_MODES, Told, mode_name
from tests.real.truth import north_east

_UNREAD = (30, 31, 32, 33, 36, 65, 83, 85, 100)
"""What PX4 sends a ground station 50 times a second; to decode it takes this computer's time."""
_ONLY_RATES = 128
"""ATTITUDE_TARGET_TYPEMASK: no attitude."""
_INT32 = 6
"""MAV_PARAM_TYPE_INT32."""


class Seen(NamedTuple):
    """Where the vehicle truly was: s of `time.monotonic`, m, degrees."""

    time: float
    north: float
    east: float
    up: float
    tilt: float


class Station:
    """Listens in a thread of its own.

    PX4: the ground station's UDP link, truth by HIL_STATE_QUATERNION. ArduPilot: a second TCP link,
    place and tilt by SIMSTATE, height by GLOBAL_POSITION_INT.

    Attributes:
        told: each change of mode, arming or status.
        hil: PX4's truth.
        up: height above home that ArduPilot tells, m.
        texts: what it said, with the time.
    """

    def __init__(self, build: Build) -> None:
        self.autopilot = autopilot = build.autopilot
        self.told: list[Told] = []
        self._seen: list[Seen] = []
        self.texts: list[tuple[float, str]] = []
        self.acks: list[tuple[float, int, int]] = []
        self.landed = 0
        self._kinds: dict[str, int] = {}
        self.up = 0.0
        self._origin: tuple[float, float] | None = None
        self._base = 0
        self._status = 0
        dialect = "development" if autopilot == "px4" else "ardupilotmega"
        self._links = [mavutil.mavlink_connection(build.station, dialect=dialect)]
        self.hil = HilTruth() if build.truth == "hil" else None
        self._running = True
        self._threads = [
            threading.Thread(target=self._listen, args=(link,), daemon=True) for link in self._links
        ]
        self._threads.append(threading.Thread(target=self._beat, daemon=True))
        for thread in self._threads:
            thread.start()

    def close(self) -> None:
        self._running = False
        for thread in self._threads:
            thread.join()
        for link in self._links:
            link.close()
        if self.hil is not None:
            self.hil.close()

    def ask_for_rates(self) -> None:
        if self.hil is not None:
            self.hil.ask_for_rate()
        wanted = {"px4": (436, 245), "ardupilot": (0, 245, 33, 164)}[self.autopilot]
        for number in wanted:
            self.command(511, number, 40_000)
            time.sleep(0.05)
        for number in _UNREAD if self.autopilot == "px4" else ():
            self.command(511, number, -1)
            time.sleep(0.05)

    def command(self, command: int, *parameters: float) -> float:
        """Send a command; returns when, s of `time.monotonic`."""
        padded = [*parameters, *[0.0] * (7 - len(parameters))]
        now = time.monotonic()
        self._links[0].mav.command_long_send(1, 1, command, 0, *padded)
        return now

    def set_mode(self, name: str) -> float:
        if self.autopilot == "px4":
            return self.command(176, 1, *PX4_MODES[name])
        return self.command(176, 1, ARDUPILOT_MODES[name])

    def send_rates(self, rates: tuple[float, float, float], thrust: float) -> None:
        """Send a setpoint of body rates (rad/s) and thrust, as another program would."""
        self._links[0].mav.set_attitude_target_send(
            0, 1, 1, _ONLY_RATES, (1.0, 0.0, 0.0, 0.0), *rates, thrust
        )

    def send_sticks(self) -> None:
        """Send the sticks of a pilot who does not touch them."""
        self._links[0].mav.manual_control_send(1, 0, 0, 500, 0, 0)

    def set_parameter(self, name: str, value: float) -> None:
        """Set a parameter, whatever its type; PX4 wants the bytes of an integer as they are."""
        self._kinds.pop(name, None)
        deadline = time.monotonic() + 10.0
        while name not in self._kinds:
            assert time.monotonic() < deadline, f"the autopilot has no parameter {name}"
            self._links[0].mav.param_request_read_send(1, 1, name.encode(), -1)
            time.sleep(0.2)
        kind = self._kinds[name]
        if self.autopilot == "px4" and kind == _INT32:
            (value,) = struct.unpack("<f", struct.pack("<i", round(value)))
        self._links[0].mav.param_set_send(1, 1, name.encode(), value, kind)

    @property
    def mode(self) -> str:
        return self.name(self.told[-1]) if self.told else "unknown"

    @property
    def armed(self) -> bool:
        return bool(self.told) and self.told[-1].armed

    def name(self, told: Told) -> str:
        return mode_name(self.autopilot, told)

    @property
    def obeys(self) -> bool:
        return self.armed and self.mode in ("OFFBOARD", "GUIDED (body rates)")

    @property
    def seen(self) -> list[Seen]:
        """The true motion."""
        if self.hil is None:
            return self._seen
        rows = list(self.hil.rows)
        origin = rows[0][6:8] if rows else (0.0, 0.0)
        return [
            Seen(row[0], *north_east(*row[6:8], origin), row[8], _tilt(1 - 2 * (x * x + y * y)))
            for row in rows
            for x, y in [row[3:5]]
        ]

    def until(self, condition, seconds: float, what: str) -> float:
        """Wait until `condition()`; returns when it was so."""
        deadline = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < deadline, f"no {what} in {seconds} s; mode {self.mode}"
            time.sleep(0.01)
        return time.monotonic()

    def modes_since(self, since: float) -> list[tuple[float, str]]:
        """(s since then, mode or arming or status) of each change."""
        first = [told for told in self.told if told.time <= since][-1:]
        out, before = [], first[0] if first else None
        for told in (each for each in self.told if each.time > since):
            at = round(told.time - since, 3)
            if before is None or self.name(told) != self.name(before):
                out.append((at, self.name(told)))
            if before is None or told.armed != before.armed:
                out.append((at, "armed" if told.armed else "disarmed"))
            if before is not None and told.status == 5 != before.status:
                out.append((at, "failsafe"))
            before = told
        return out

    def motion_since(self, since: float, until: float = inf) -> dict[str, float]:
        """How far, how high and how tilted it was, from where it was at `since`."""
        before = [seen for seen in self.seen if seen.time <= since]
        rows = [seen for seen in self.seen if since <= seen.time <= until]
        if not before or not rows:
            return {}
        start = before[-1]
        away = [hypot(row.north - start.north, row.east - start.east) for row in rows]
        return {
            "farthest_m": round(max(away), 2),
            "end_m": round(away[-1], 2),
            "highest_above_m": round(max(row.up for row in rows) - start.up, 2),
            "lowest_below_m": round(start.up - min(row.up for row in rows), 2),
            "tilt_deg": round(max(row.tilt for row in rows), 1),
        }

    def _beat(self) -> None:
        while self._running:
            self._links[0].mav.heartbeat_send(6, 8, 0, 0, 4)
            time.sleep(0.5)

    def _listen(self, link) -> None:
        while self._running:
            message = link.recv_match(blocking=True, timeout=0.1)
            if message is None or message.get_srcSystem() != 1:
                continue
            self._take(message, time.monotonic())

    def _take(self, message, now: float) -> None:
        kind = message.get_type()
        if kind == "HEARTBEAT" and message.autopilot != 8:
            self._base, self._status = message.base_mode, message.system_status
            self._tell(Told(now, message.custom_mode, self._base, self._status))
        elif kind == "CURRENT_MODE" and self.told and self.autopilot == "px4":
            self._tell(Told(now, message.custom_mode, self._base, self._status))
        elif kind == "STATUSTEXT":
            self.texts.append((now, message.text.strip()))
        elif kind == "COMMAND_ACK":
            self.acks.append((now, message.command, message.result))
        elif kind == "PARAM_VALUE":
            self._kinds[message.param_id] = message.param_type
        elif kind == "EXTENDED_SYS_STATE":
            self.landed = message.landed_state
        elif kind == "GLOBAL_POSITION_INT":
            self.up = message.relative_alt / 1e3
        elif kind == "SIMSTATE":
            level = cos(message.roll) * cos(message.pitch)
            self._see(now, message.lat, message.lng, self.up, _tilt(level))

    def _tell(self, told: Told) -> None:
        if not self.told or self.told[-1][1:] != told[1:]:
            self.told.append(told)

    def _see(self, now: float, latitude: int, longitude: int, up: float, tilt: float) -> None:
        place = latitude / 1e7, longitude / 1e7
        if self._origin is None:
            self._origin = place
        self._seen.append(Seen(now, *north_east(*place, self._origin), up, tilt))


def _tilt(cosine: float) -> float:
    return degrees(acos(max(-1.0, min(1.0, cosine))))
