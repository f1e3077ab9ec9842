"""The mock vehicle as a process of its own, for `companion demo`."""

import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from companion.files.yaml_file import ConfigError
from companion.mavlink.transport.endpoint import (
    SerialPort,
    TcpClient,
    TcpServer,
    parse_endpoint,
)
from companion.mavlink.transport.free_port import free_port

_LOCAL_PORT_OFFSET = 40
"""The mock vehicle's UDP port number minus this program's."""

_READY_LINE = "ready on "
"""First words of the vehicle's output when its ports are open."""

_START_TIMEOUT = 20.0
"""Time allowed for the vehicle to start, s."""


class LocalEndpoints(NamedTuple):
    """The two ends of a UDP, TCP or serial connection on this computer."""

    program: str
    """Endpoint of this program, in the notation of `link.endpoint`."""
    vehicle_arguments: tuple[str, ...]
    """Endpoint of the mock vehicle, as arguments of its command line."""


class VehicleStoppedError(Exception):
    """The mock vehicle did not start, or ended before the flight did."""


@contextmanager
def local_endpoints(endpoint: str) -> Iterator[LocalEndpoints]:
    """Free endpoints of the same kind as `endpoint` (UDP, TCP or serial), for the `with` block.

    Over TCP the vehicle always listens and the program connects.

    Raises:
        EndpointError: the endpoint's notation is wrong.
        LinkError: there are no free ports.
    """
    match parse_endpoint(endpoint):
        case TcpClient() | TcpServer():
            port = free_port()
            vehicle_arguments = ("--endpoint", f"tcpin://127.0.0.1:{port}")
            yield LocalEndpoints(f"tcp://127.0.0.1:{port}", vehicle_arguments)
        case SerialPort(_, baud):
            with tempfile.TemporaryDirectory(prefix="companion-") as folder:
                path = Path(folder, "vehicle")
                yield LocalEndpoints(f"serial://{path}:{baud}", ("--endpoint", f"serial://{path}"))
        case _:
            port = free_port(_LOCAL_PORT_OFFSET)
            yield LocalEndpoints(f"udpin://127.0.0.1:{port}", ("--port", str(port)))


def check_mock(config: Path) -> None:
    """Let the mock vehicle check the section `mock` of a configuration.

    Raises:
        ConfigError: the section is wrong; the message comes from the mock vehicle.
    """
    command = [sys.executable, "-m", "sitl_mock", "--check", "--config", str(config)]
    check = subprocess.run(command, capture_output=True, text=True, check=False)
    if check.returncode != 0:
        raise ConfigError(check.stderr.strip() or "the mock vehicle refused its configuration")


@contextmanager
def bundled_vehicle(
    config: Path, endpoints: LocalEndpoints, log: Path, *, lockstep: bool
) -> Iterator[None]:
    """Run the mock vehicle while the block runs; its output goes to `log`.

    The vehicle's process has its own session, so Ctrl-C reaches only this program, which can then
    hand the vehicle back. The standard input of the process is a pipe. The pipe closes when this
    program ends, even by kill -9, and then the process ends too.

    Raises:
        OSError: `log` cannot be written.
        VehicleStoppedError: the vehicle stopped by itself (the message has its last line of
            output), or was not ready within `_START_TIMEOUT`.
    """
    command = [sys.executable, "-m", "sitl_mock", "--headless", "--config", str(config)]
    # No link for a ground station: its fixed port may be in use.
    command += ["--end-with-stdin", *endpoints.vehicle_arguments, "--gcs-port", "0"]
    command += ["--lockstep"] if lockstep else []
    with log.open("wb") as output:
        process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=output, stderr=output, start_new_session=True
        )
        try:
            _await_ready(process, log)
            yield
        finally:
            _end_vehicle(process, log)


def _end_vehicle(process: "subprocess.Popen[bytes]", log: Path) -> None:
    """End the vehicle's process.

    Raises:
        VehicleStoppedError: the process had already ended.
    """
    try:
        _check_running(process, log)
        process.terminate()
        try:
            process.wait(timeout=5.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
    finally:
        if process.stdin is not None:
            process.stdin.close()


def _await_ready(process: "subprocess.Popen[bytes]", log: Path) -> None:
    deadline = time.monotonic() + _START_TIMEOUT
    while not log.read_text(errors="replace").startswith(_READY_LINE):
        _check_running(process, log)
        if time.monotonic() > deadline:
            raise VehicleStoppedError(
                f"the mock vehicle did not start within {_START_TIMEOUT:g} s, see {log}"
            )
        time.sleep(0.02)


def _check_running(process: "subprocess.Popen[bytes]", log: Path) -> None:
    if process.poll() is not None:
        last_line = log.read_text(errors="replace").strip().rpartition("\n")[2]
        last_line = last_line or "the log is empty; is the disk full?"
        raise VehicleStoppedError(f"the mock vehicle stopped, see {log}: {last_line}")
