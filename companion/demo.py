"""The bundled vehicle as a process of its own, for `companion demo`."""

import socket
import subprocess
import sys
import sysconfig
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from companion.yaml_file import ConfigError

_LOCAL_PORT_OFFSET = 40
"""The vehicle sends from this many ports above the one it sends to."""


_START = 0.7
"""A vehicle that cannot start has said so by then, s."""


class VehicleStoppedError(Exception):
    """The bundled vehicle ended before the flight did."""


def default_config() -> Path:
    """The configuration that ships with the program: in the repository, or where pip put it.

    Raises:
        ConfigError: it is in neither place.
    """
    repository = Path(__file__).parent.parent
    installed = Path(sysconfig.get_path("data"), "share", "mavlink-companion")
    for place in (repository, installed):
        path = place / "configs" / "mock-px4.yaml"
        if path.is_file():
            return path
    raise ConfigError(f"mock-px4.yaml is not in {installed}; name a configuration with --config")


def free_port() -> int:
    """A UDP port on which a companion can listen and a mock vehicle can have its own beside it."""
    for _ in range(100):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as first:
            first.bind(("127.0.0.1", 0))
            port: int = first.getsockname()[1]
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as second:
                try:
                    second.bind(("127.0.0.1", port + _LOCAL_PORT_OFFSET))
                except (OSError, OverflowError):
                    continue
                return port
    raise ConfigError("no free pair of UDP ports on this machine")


def check_mock(config: Path) -> None:
    """Let the vehicle itself check its section of a configuration.

    Raises:
        ConfigError: with the vehicle's own words.
    """
    _run_check([sys.executable, "-m", "sitl_mock", "--check", "--config", str(config)])


def _run_check(command: list[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise ConfigError(done.stderr.strip() or "the mock vehicle refused its configuration")


@contextmanager
def bundled_vehicle(config: Path, port: int, log: Path, *, lockstep: bool) -> Iterator[None]:
    """Run the mock vehicle while the block runs; its own words go to `log`.

    It has a session of its own, so that Ctrl-C reaches us alone and the vehicle can still be
    handed back to its autopilot.

    Raises:
        VehicleStoppedError: it stopped by itself, at once or meanwhile; with its last words.
    """
    command = [sys.executable, "-m", "sitl_mock", "--headless", "--config", str(config)]
    # No ground station's link: its port is a fixed one, and may be somebody else's.
    command += ["--port", str(port), "--gcs-port", "0", *(["--lockstep"] if lockstep else [])]
    with log.open("wb") as words:
        process = subprocess.Popen(command, stdout=words, stderr=words, start_new_session=True)
        try:
            _check_running(process, log, _START)
            yield
        finally:
            _check_running(process, log, 0.0)
            process.terminate()
            try:
                process.wait(timeout=5.0)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def _check_running(process: "subprocess.Popen[bytes]", log: Path, patience: float) -> None:
    with suppress(subprocess.TimeoutExpired):
        process.wait(timeout=patience)
        last = log.read_text(errors="replace").strip().rpartition("\n")[2]
        raise VehicleStoppedError(f"the bundled vehicle stopped, see {log}: {last}")
