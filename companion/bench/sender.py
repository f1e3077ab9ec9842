"""Simulates the vehicle of a benchmark: sends attitude samples, and times the setpoints."""

import contextlib
import select
import socket
import struct
import time
from collections.abc import Callable, Sequence
from math import degrees
from typing import Any

from pymavlink.dialects.v20 import common as dialect

from companion.bench.process import BenchmarkedProgram, BenchmarkError

StampReader = Callable[[bytes], int]
"""Reads from the bytes of a setpoint the time stamp of its sample, ms. The time stamp may wrap."""
TIME_MODULUS = 2**32
"""Value at which `time_boot_ms` wraps, ms."""
_SETPOINT_BYTES = 51
_SETPOINT_ID = 82
_TIME_OFFSET, _YAW_RATE_OFFSET = 10, 38
_READY_TIMEOUT_S = 30.0
_SETTLE_SAMPLES = 25  # not counted, at the start of each round
_PX4, _QUADROTOR, _OFFBOARD_ARMED, _OFFBOARD, _ACTIVE = 12, 2, 129, 0x00060000, 4
_ATTITUDE = (0.99, 0.05, 0.05, 0.1197)


def stamp_by_time(setpoint: bytes) -> int:
    """The time stamp (ms) of the sample, in `time_boot_ms` of a SET_ATTITUDE_TARGET frame."""
    return int.from_bytes(setpoint[_TIME_OFFSET : _TIME_OFFSET + 4], "little")


def stamp_by_yaw_rate(setpoint: bytes) -> int:
    """The time stamp (ms) that `mavsdk_program` returns in the yaw rate, 1 °/s for each ms."""
    return round(degrees(struct.unpack_from("<f", setpoint, _YAW_RATE_OFFSET)[0]))


class Sender:
    """Simulates one vehicle for one program.

    Args:
        program: the measured program, which answers the samples; `Sender.close` stops it.
        read_stamp: reads from a setpoint the time stamp of its sample.
        modulus: value at which the time stamps in setpoints wrap, ms.
        extra_messages: messages that follow each sample, each in a datagram of its own.

    Attributes:
        round_trips_ns: times from sample to setpoint, ns.
        sent_samples: number of samples sent in measured rounds.
        cpu_ns: processor time of the program in measured rounds, ns.
        wall_ns: duration of the measured rounds, ns.
    """

    def __init__(
        self,
        program: BenchmarkedProgram,
        read_stamp: StampReader = stamp_by_time,
        modulus: int = TIME_MODULUS,
        extra_messages: Sequence[Any] = (),
    ) -> None:
        self._extra_messages = extra_messages
        self._program, self._read_stamp, self._modulus = program, read_stamp, modulus
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.setblocking(False)
        self._poll = select.poll()
        self._poll.register(self._socket, select.POLLIN)
        self._mav = dialect.MAVLink(None, 1, 1)
        self._parser = dialect.MAVLink(None)
        self._parser.robust_parsing = True
        self._boot_ns = time.perf_counter_ns()
        self._time_ms = 0
        self._sent_ns: dict[int, int] = {}  # time stamp of a sample -> time of sending
        self._recording = False
        self.round_trips_ns: list[int] = []
        self.sent_samples = 0
        self.cpu_ns = 0
        self.wall_ns = 0

    @property
    def name(self) -> str:
        """Name of the program, to show to users."""
        return self._program.name

    def close(self) -> None:
        """Stop the program, and close the socket."""
        self._program.stop()
        self._socket.close()

    def send_heartbeat(self) -> None:
        """Send the heartbeat of an armed PX4 vehicle in offboard mode."""
        self._send_message(
            dialect.MAVLink_heartbeat_message(
                _QUADROTOR, _PX4, _OFFBOARD_ARMED, _OFFBOARD, _ACTIVE, 3
            )
        )

    def wait_ready(self) -> None:
        """Send samples until the program answers one.

        Raises:
            BenchmarkError: the program ended, or did not answer within 30 s.
        """
        deadline = time.monotonic() + _READY_TIMEOUT_S
        heartbeat_due = 0.0
        answered = False
        while not answered:
            self._program.check_running()
            if time.monotonic() > deadline:
                raise BenchmarkError(
                    f"{self._program.name} did not answer within {_READY_TIMEOUT_S:g} s"
                )
            if time.monotonic() > heartbeat_due:
                heartbeat_due = time.monotonic() + 0.5
                self.send_heartbeat()
            self._send_sample()
            answered = self._listen_until(time.perf_counter_ns() + 20_000_000)

    def send_for(self, rate_hz: float, seconds: float) -> None:
        """Send samples at `rate_hz` for `seconds`, and record the round trips.

        Raises:
            BenchmarkError: the program ended.
        """
        self._program.check_running()
        self.send_heartbeat()
        due_ns = self._send_samples(_SETTLE_SAMPLES, rate_hz, time.perf_counter_ns())
        self._sent_ns.clear()
        self._recording = True
        cpu_start_ns, wall_start_ns = self._program.cpu_ns(), time.perf_counter_ns()
        count = round(rate_hz * seconds)
        self._send_samples(count, rate_hz, due_ns)
        self.sent_samples += count
        self.cpu_ns += self._program.cpu_ns() - cpu_start_ns
        self.wall_ns += time.perf_counter_ns() - wall_start_ns
        self._recording = False

    def reset_measurements(self) -> None:
        """Forget the round trips, and set counts and times to 0."""
        self.round_trips_ns.clear()
        self.sent_samples = self.cpu_ns = self.wall_ns = 0

    def _send_samples(self, count: int, rate_hz: float, due_ns: int) -> int:
        period_ns = round(1e9 / rate_hz)
        for _ in range(count):
            self._send_sample()
            due_ns += period_ns
            self._listen_until(due_ns)
        return due_ns

    def _send_sample(self) -> None:
        # The stamp follows real time, and is unique because it identifies the answer.
        self._time_ms = max(
            self._time_ms + 1, (time.perf_counter_ns() - self._boot_ns) // 1_000_000
        )
        frame = self._pack(
            dialect.MAVLink_attitude_quaternion_message(self._time_ms, *_ATTITUDE, 0.01, 0.02, 0.03)
        )
        self._sent_ns[self._time_ms % self._modulus] = time.perf_counter_ns()
        self._send(frame)
        for message in self._extra_messages:
            self._send_message(message)

    def _listen_until(self, due_ns: int) -> bool:
        """Receive until the time `due_ns`; return whether a setpoint answered a sample."""
        is_answered = False
        while (remaining_ns := due_ns - time.perf_counter_ns()) > 0:
            # poll() counts whole milliseconds; the rest is slept.
            if not self._poll.poll(remaining_ns // 1_000_000):
                time.sleep(max(0, due_ns - time.perf_counter_ns()) * 1e-9)
            try:
                data = self._socket.recv(2048)
            except OSError:
                continue  # no answer yet, or the program has not started yet
            now = time.perf_counter_ns()
            if len(data) == _SETPOINT_BYTES and data[7] == _SETPOINT_ID:
                sent_ns = self._sent_ns.pop(self._read_stamp(data) % self._modulus, None)
                is_answered = is_answered or sent_ns is not None
                if sent_ns is not None and self._recording:
                    self.round_trips_ns.append(now - sent_ns)
            else:
                self._accept_commands(data)
        return is_answered

    def _accept_commands(self, data: bytes) -> None:
        """Accept every command in the received bytes; MAVSDK needs this to start."""
        for message in self._parser.parse_buffer(data) or ():
            if message.get_type() == "COMMAND_LONG":
                self._send_message(dialect.MAVLink_command_ack_message(message.command, 0))

    def _send_message(self, message: Any) -> None:
        self._send(self._pack(message))

    def _pack(self, message: Any) -> bytes:
        frame: bytes = message.pack(self._mav)
        self._mav.seq = (self._mav.seq + 1) & 0xFF
        return frame

    def _send(self, frame: bytes) -> None:
        with contextlib.suppress(OSError):  # refused: the program has not started yet
            self._socket.sendto(frame, ("127.0.0.1", self._program.port))
