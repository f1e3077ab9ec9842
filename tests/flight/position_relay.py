"""A second path for positions: it stands between the mock and the program, in vehicle time."""

import select
import socket
import threading
from collections import deque
from contextlib import suppress

from companion.demo import free_port

_ATTITUDE_QUATERNION, _LOCAL_POSITION_NED = 31, 32
_OVERHEAD = 12
_HOST = "127.0.0.1"


class PositionRelay:
    """Passes all datagrams on; positions as `way` says. Runs in a thread while its block runs.

    Attributes:
        endpoint: where the program is to listen.
        way: "at once"; "late": by `delay_ms`; "twice": at once and late; "standing": the last one
            that came by another way, again and again.
        delay_ms: by the vehicle's clock, as its attitudes tell it.
    """

    def __init__(self, vehicle_port, way="at once", delay_ms=0):
        self.way, self.delay_ms = way, delay_ms
        port = free_port()
        self.endpoint = f"udpin://{_HOST}:{port}"
        self._vehicle = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._vehicle.bind((_HOST, vehicle_port))
        self._program = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._program.connect((_HOST, port))
        self._program.setblocking(False)
        self._held, self._last = deque(), None
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._pass_on, daemon=True)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._over.set()
        self._thread.join()
        self._vehicle.close()
        self._program.close()

    def _pass_on(self):
        address = None
        while not self._over.is_set():
            ready, _, _ = select.select([self._vehicle, self._program], [], [], 0.1)
            if self._vehicle in ready:
                data, address = self._vehicle.recvfrom(4096)
                self._send(self._from_vehicle(data))
            if self._program in ready:
                # The refusal that made it readable may have been told to the send before.
                with suppress(ConnectionRefusedError, BlockingIOError):
                    self._vehicle.sendto(self._program.recv(4096), address)

    def _send(self, datagram):
        with suppress(ConnectionRefusedError):  # the program is not up yet, or not any more
            self._program.send(datagram)

    def _from_vehicle(self, data):
        """What to send now that these frames (of MAVLink 2, unsigned) came in one datagram."""
        sent = b""
        while data:
            end = _OVERHEAD + data[1]
            frame, data = data[:end], data[end:]
            message = int.from_bytes(frame[7:10], "little")
            stamp = int.from_bytes(frame[10:-2][:4], "little")  # zeros at the end are left out
            if message == _LOCAL_POSITION_NED:
                sent += self._position(stamp, frame)
                continue
            if message == _ATTITUDE_QUATERNION:
                while self._held and self._held[0][0] <= stamp:
                    sent += self._held.popleft()[1]
            sent += frame
        return sent

    def _position(self, stamp, frame):
        if self.way in ("late", "twice"):
            self._held.append((stamp + self.delay_ms, frame))
        if self.way == "standing":
            return self._last
        if self.way == "late":
            return b""
        self._last = frame
        return frame
