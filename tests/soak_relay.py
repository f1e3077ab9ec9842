"""Between the vehicle and the program: passes datagrams on, and times each sample's answer.

A sample's time begins as it is passed on, and ends by the kernel's stamp of the answer: so a relay
that wakes up late does not measure itself.
"""

import math
import select
import socket
import struct
import threading
import time
from collections.abc import Callable

from sitl_mock.link.framing import decode

DEADLINE_S = 0.004
"""`deadman.deadline_ms`, its default."""
DOUBT_S = 0.001
"""What the kernel takes on the way, both ways."""
_SO_TIMESTAMPNS = getattr(socket, "SO_TIMESTAMPNS", 35)
_STAMP = struct.Struct("@qq")
_PATIENCE_S = 0.5
_HOST = "127.0.0.1"


class Answers:
    """When each sample left for the program, and when the setpoint that answers it came.

    Only samples between the first and the last setpoint count: before and after, the program is
    not asked to answer.
    """

    def __init__(self) -> None:
        self._sent: dict[int, float] = {}
        self._answered: set[int] = set()
        self._took: list[float] = []
        self._missing = self._since_answer = 0
        self._first = math.inf

    def sample(self, time_boot_ms: int, now: float) -> None:
        """A sample goes to the program; one that comes twice is not to be answered twice."""
        while self._sent:
            stamp, sent = next(iter(self._sent.items()))
            if now - sent < _PATIENCE_S:
                break
            del self._sent[stamp]
            if stamp in self._answered:
                self._answered.remove(stamp)
            elif sent > self._first:
                self._since_answer += 1
        self._sent.setdefault(time_boot_ms, now)

    def setpoint(self, time_boot_ms: int, now: float) -> None:
        """An answer came."""
        sent = self._sent.get(time_boot_ms)
        if sent is None or time_boot_ms in self._answered:
            return
        self._answered.add(time_boot_ms)
        self._first = min(self._first, now)
        self._missing += self._since_answer
        self._since_answer = 0
        self._took.append(now - sent)

    def figures(self) -> dict[str, int]:
        """Counts: answered, late, missing."""
        late = sum(took > DEADLINE_S + DOUBT_S for took in self._took)
        return {"answered": len(self._took), "late": late, "missing": self._missing}


class Relay:
    """Runs in a thread while its block runs.

    Args:
        vehicle_port: where the vehicle sends to.
        companion_port: where the program listens.
        begin: called in the thread, first.
    """

    def __init__(self, vehicle_port: int, companion_port: int, begin: Callable[[], None]) -> None:
        self.companion_port = companion_port
        self.answers = Answers()
        self.began = time.monotonic()
        self._to_vehicle = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._to_vehicle.bind((_HOST, vehicle_port))
        self._to_companion = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._to_companion.connect((_HOST, companion_port))
        self._to_companion.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
        self._begin, self._over = begin, threading.Event()
        self._thread = threading.Thread(target=self._pass_on, daemon=True)

    def __enter__(self) -> "Relay":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()
        self._to_vehicle.close()
        self._to_companion.close()

    def _pass_on(self) -> None:
        self._begin()
        vehicle = None
        while not self._over.is_set():
            ready, _, _ = select.select([self._to_vehicle, self._to_companion], [], [], 0.1)
            if self._to_vehicle in ready:
                data, vehicle = self._to_vehicle.recvfrom(4096)
                now = time.monotonic()
                try:
                    self._to_companion.send(data)
                except ConnectionRefusedError:
                    continue  # the program is not up yet
                for message in decode(data):
                    if message.get_type() == "ATTITUDE_QUATERNION":
                        self.answers.sample(message.time_boot_ms, now)
            if self._to_companion in ready:
                try:
                    data, stamps, _, _ = self._to_companion.recvmsg(4096, 64)
                except ConnectionRefusedError:
                    continue
                if vehicle is not None:
                    self._to_vehicle.sendto(data, vehicle)
                for message in decode(data):
                    if message.get_type() == "SET_ATTITUDE_TARGET":
                        self.answers.setpoint(message.time_boot_ms, _arrived(stamps))


def _arrived(stamps: list[tuple[int, int, bytes]]) -> float:
    """When the kernel took a datagram, by `time.monotonic`."""
    seconds, nanoseconds = _STAMP.unpack(stamps[0][2])
    return time.monotonic() - (time.time() - seconds - 1e-9 * nanoseconds)
