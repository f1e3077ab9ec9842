"""The vehicle's side of the benchmark: sends samples at a rate, times what comes back."""

import select
import socket
import struct
import time
from collections.abc import Callable
from math import degrees

from pymavlink.dialects.v20 import common as dialect

from companion.bench.process import Contestant, ContestantError

Stamp = Callable[[bytes], int]
"""The sample's time stamp in ms that a setpoint answers; modulo the contestant's own."""

_SETPOINT_BYTES = 51
_SETPOINT_ID = 82
_TIME_AT, _YAW_RATE_AT = 10, 38
_READY_TIMEOUT_S = 30.0
_SETTLE_SAMPLES = 25  # at the start of each round, until the contestant is awake again
_PX4, _QUADROTOR, _OFFBOARD_ARMED, _OFFBOARD, _ACTIVE = 12, 2, 129, 0x00060000, 4
_TILT = (0.99, 0.05, 0.05, 0.1197)


def stamp_by_time(setpoint: bytes) -> int:
    """`time_boot_ms` of a SET_ATTITUDE_TARGET frame."""
    stamp: int = struct.unpack_from("<I", setpoint, _TIME_AT)[0]
    return stamp


def stamp_by_yaw_rate(setpoint: bytes) -> int:
    """The stamp that was put in the yaw rate, as whole degrees per second."""
    return round(degrees(struct.unpack_from("<f", setpoint, _YAW_RATE_AT)[0]))


class Sender:
    """One vehicle that plays to one contestant.

    Args:
        contestant: Who answers.
        stamp: Finds the sample that a setpoint answers.
        modulus: At which those stamps wrap.
    """

    def __init__(self, contestant: Contestant, stamp: Stamp, modulus: int) -> None:
        self._contestant, self._stamp, self._modulus = contestant, stamp, modulus
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.setblocking(False)
        self._poll = select.poll()
        self._poll.register(self._socket, select.POLLIN)
        self._mav = dialect.MAVLink(None, 1, 1)
        self._parser = dialect.MAVLink(None)
        self._parser.robust_parsing = True
        self._time_ms = 0
        self._under_way: dict[int, int] = {}
        self.round_trips_ns: list[int] = []
        self.sent = 0
        self.cpu_ns = 0
        self.wall_ns = 0

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

    def heartbeat(self) -> None:
        """Say that the vehicle is there, in offboard and armed."""
        self._say(
            dialect.MAVLink_heartbeat_message(
                _QUADROTOR, _PX4, _OFFBOARD_ARMED, _OFFBOARD, _ACTIVE, 3
            )
        )

    def wait_ready(self) -> None:
        """Play until the contestant answers.

        Raises:
            ContestantError: It ended, or did not answer within 30 s.
        """
        end = time.monotonic() + _READY_TIMEOUT_S
        beat = 0.0
        while not self.round_trips_ns:
            self._contestant.check_running()
            if time.monotonic() > end:
                raise ContestantError(
                    f"{self._contestant.name} did not answer within {_READY_TIMEOUT_S:g} s"
                )
            if time.monotonic() > beat:
                beat = time.monotonic() + 0.5
                self.heartbeat()
            self._sample(4)
            self._listen_until(time.perf_counter_ns() + 20_000_000)
        self.round_trips_ns.clear()

    def play(self, rate_hz: float, seconds: float) -> None:
        """Send samples at `rate_hz` for `seconds`, and keep the round trips.

        Raises:
            ContestantError: The contestant ended.
        """
        self._contestant.check_running()
        self.heartbeat()
        period_ns = round(1e9 / rate_hz)
        period_ms = max(1, round(1000.0 / rate_hz))
        due = time.perf_counter_ns() + period_ns
        for _ in range(_SETTLE_SAMPLES):
            self._listen_until(due)
            self._sample(period_ms)
            due += period_ns
        self._listen_until(due)
        before, cpu = len(self.round_trips_ns), self._contestant.cpu_ns()
        began = time.perf_counter_ns()
        del self.round_trips_ns[before - min(before, self._fresh) :]
        for _ in range(round(rate_hz * seconds)):
            self._sample(period_ms)
            due += period_ns
            self._listen_until(due)
            self.sent += 1
        self.cpu_ns += self._contestant.cpu_ns() - cpu
        self.wall_ns += time.perf_counter_ns() - began
