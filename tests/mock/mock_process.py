"""The mock as a process of its own, and a plain-socket client for it."""

import contextlib
import json
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from typing import Any

from pymavlink.dialects.v20 import development as dialect

from companion.mavlink.transport import free_port as ports
from sitl_mock.config.settings import GCS_PORT_OFFSET, PORT_OFFSET
from sitl_mock.link.framing import Framer, decode
from tests.flight.programs import Program

HOST = "127.0.0.1"


def is_free(port: int) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind((HOST, port))
        except OSError:
            return False
    return True


def free_port(count: int = 1, *offsets: int) -> int:
    """Return a UDP port that is free, with `count` successors, also at each offset above it."""
    wanted = (i + offset for i in range(count) for offset in (0, PORT_OFFSET, *offsets))
    return ports.free_port(*wanted)


def free_gcs_port() -> int:
    return free_port(1, GCS_PORT_OFFSET)


def started_by_hand(*arguments: Any) -> subprocess.Popen[str]:
    """`python -m sitl_mock`, as users start it."""
    return subprocess.Popen(
        [sys.executable, "-m", "sitl_mock", *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def started(*arguments: Any) -> Program:
    """The same with its imports already done."""
    return Program("sitl_mock.__main__", *arguments)


@contextlib.contextmanager
def mock_process(*arguments: Any, start: Callable[..., Any] = started) -> Iterator[Any]:
    """Run `python -m sitl_mock`, end it by SIGTERM, and check that it ended well and silently."""
    process = start("--headless", *arguments)
    try:
        yield process
        process.send_signal(signal.SIGTERM)
        _, errors = process.communicate(timeout=10)
        assert (process.returncode, errors) == (0, "")
    finally:
        if process.poll() is None:
            process.kill()
            process.communicate()


class Client:
    """A companion on a plain socket, bound to the port the mock sends to."""

    def __init__(self, port: int, *, timeout: float = 10.0) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind((HOST, port))
        self.socket.settimeout(timeout)
        self.mock = (HOST, port + PORT_OFFSET)
        self.framer = Framer(255, 190)

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    def send(self, message: Any) -> None:
        self.socket.sendto(self.framer.frame(message), self.mock)

    def command(self, number: int, *parameters: float) -> None:
        padded = [*parameters, *([0.0] * (7 - len(parameters)))]
        self.send(dialect.MAVLink_command_long_message(1, 1, number, 0, *padded))

    def receive(self) -> bytes:
        return self.socket.recv(4096)

    def wait_for(self, name: str, condition: Callable[[Any], bool] = lambda _: True) -> Any:
        """Return the next message of a name that meets a condition."""
        while True:
            for message in decode(self.receive()):
                if message.get_type() == name and condition(message):
                    return message

    def answer(self, time_boot_ms: int) -> None:
        self.send(dialect.MAVLink_system_time_message(0, time_boot_ms))

    def lockstep(self, until_ms: int, act: Callable[[int], bool]) -> list[bytes]:
        """Answer beacons up to a time; `act(t)` says what to say, True = it has answered itself.

        Returns:
            every datagram but beacons that came again, in order.
        """
        datagrams: list[bytes] = []
        now = -1
        while now < until_ms:
            datagram = self.receive()
            messages = decode(datagram)
            if not (messages and messages[-1].get_type() == "SYSTEM_TIME"):
                datagrams.append(datagram)
                continue
            beacon = messages[-1].time_boot_ms
            if beacon <= now:
                self.answer(beacon)
                continue
            now = beacon
            datagrams.append(datagram)
            if not act(now):
                self.answer(now)
        return datagrams


def ask(port: int, request: Any) -> dict[str, Any]:
    """Send one request to the control channel and return the answer."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as control:
        control.settimeout(10.0)
        data = request if isinstance(request, bytes) else json.dumps(request).encode()
        control.sendto(data, (HOST, port))
        answer: dict[str, Any] = json.loads(control.recv(65536))
        return answer
