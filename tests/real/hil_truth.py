"""PX4's truth: HIL_STATE_QUATERNION, which its simulators send on a link of their own."""

import socket
import struct
import threading
import time

import numpy as np
from pymavlink.dialects.v20 import common

from tests.real.relay import frames
from tests.real.truth import Floats, NoTruthError, Truth, north_east, truth_from

HIL_STATE_QUATERNION, HIL_ACTUATOR_CONTROLS = 115, 93
_PAYLOAD = struct.Struct("<Q7f3i")
"""time_usec, quaternion, body rates, latitude, longitude (1e-7 degrees), altitude (mm)."""
_HEADER = 10
_INTERVAL_US = 4000
_HOST = "127.0.0.1"


class HilTruth:
    """Listens in a thread of its own; decodes no more than it needs, so that it takes little time.

    Its stamp, `time_usec`, is of the clock that stamps ATTITUDE_QUATERNION, in steps of 4 ms.

    Attributes:
        rows: (arrival s of `time.monotonic`, vehicle time s, w, x, y, z, latitude and longitude in
            degrees, altitude in m).

    Args:
        port: on which it comes (PX4's SIH: 19410).
        vehicle_port: to which the wish for a higher rate goes (19450).
    """

    def __init__(self, port: int = 19410, vehicle_port: int = 19450) -> None:
        self.rows: list[tuple[float, ...]] = []
        self._vehicle = (_HOST, vehicle_port)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind((_HOST, port))
        self._socket.settimeout(0.2)
        self._running = True
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop listening."""
        self._running = False
        self._thread.join()
        self._socket.close()

    def ask_for_rate(self) -> None:
        """250 Hz of it, and none of the simulated actuators."""
        sender = common.MAVLink(None, srcSystem=255, srcComponent=190)
        for number, interval in ((HIL_STATE_QUATERNION, _INTERVAL_US), (HIL_ACTUATOR_CONTROLS, -1)):
            wish = common.MAVLink_command_long_message(
                1, 1, 511, 0, number, interval, 0, 0, 0, 0, 0
            )
            self._socket.sendto(wish.pack(sender), self._vehicle)
            time.sleep(0.05)

    def since(self, arrival: float) -> Truth:
        """What came since then, s of `time.monotonic`.

        Raises:
            NoTruthError: nothing did.
        """
        rows = np.array([row for row in list(self.rows) if row[0] >= arrival])
        if len(rows) == 0:
            raise NoTruthError("no HIL_STATE_QUATERNION came")
        return truth_from(_positions(rows), rows[:, 1:6])

    def _listen(self) -> None:
        while self._running:
            try:
                data = self._socket.recv(65536)
            except TimeoutError:
                continue
            now = time.monotonic()
            for number, frame in frames(data):
                if number == HIL_STATE_QUATERNION:
                    self._take(now, frame)

    def _take(self, now: float, frame: bytes) -> None:
        payload = frame[_HEADER : _HEADER + frame[1]].ljust(_PAYLOAD.size, b"\0")
        stamp, w, x, y, z, _, _, _, latitude, longitude, altitude = _PAYLOAD.unpack_from(payload)
        self.rows.append(
            (now, stamp / 1e6, w, x, y, z, latitude / 1e7, longitude / 1e7, altitude / 1e3)
        )


def _positions(rows: Floats) -> Floats:
    origin = (float(rows[0, 6]), float(rows[0, 7]))
    places = np.array([north_east(row[6], row[7], origin) for row in rows])
    return np.column_stack([rows[:, 1], places, -rows[:, 8]])
