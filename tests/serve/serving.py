"""The mock and `companion serve` as processes, and where the mock vehicle truly is."""

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np

from companion.mavlink.transport.free_port import free_port

ROOT = Path(__file__).parents[2]


def free_ports(count):
    return [free_port() for _ in range(count)]


@contextlib.contextmanager
def mock(port, *arguments):
    """A mock vehicle that sends to `port`."""
    process = subprocess.Popen(
        [sys.executable, "-m", "sitl_mock", "--headless", "--port", str(port), "--gcs-port", "0",
         *map(str, arguments)],
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, cwd=ROOT,
    )  # fmt: skip
    try:
        yield process
    finally:
        process.terminate()
        _, errors = process.communicate(timeout=10)
    assert (process.returncode, errors) == (0, "")


class Serving:
    """What `companion serve` printed when it had ended."""

    counters = None
    said = ""


@contextlib.contextmanager
def serving(port, *endpoints, config="configs/mock-px4.yaml", settings=()):
    """`companion serve` between the vehicle that sends to `port` and these endpoints."""
    command = [
        sys.executable, "-c", "import sys; from companion.cli.main import main; sys.exit(main())",
        "serve", "--json", "--config", config, "--endpoint", f"udpin://127.0.0.1:{port}",
    ]  # fmt: skip
    for endpoint in endpoints:
        command += ["--client", endpoint]
    for each in settings:
        command += ["--set", each]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )  # fmt: skip
    result = Serving()
    try:
        yield result
        process.send_signal(signal.SIGINT)
        out, result.said = process.communicate(timeout=60)
        assert process.returncode == 0, result.said
        result.counters = json.loads(out.splitlines()[-1])
    finally:
        if process.poll() is None:
            process.kill()
            process.communicate()


class TruthLog(threading.Thread):
    """Asks a mock vehicle for its true position, 100 times a second, while the block runs.

    Args:
        control_port: of the mock.

    Attributes:
        rows: (time.monotonic() s, north m, east m, down m).
        crashed: whether the vehicle has.
    """

    def __init__(self, control_port):
        super().__init__(daemon=True)
        self.rows, self.crashed = [], False
        self._address, self._over = ("127.0.0.1", control_port), threading.Event()

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        self._over.set()
        self.join()

    def run(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as channel:
            channel.settimeout(0.1)
            while not self._over.wait(0.01):
                began = time.monotonic()
                try:
                    channel.sendto(b'{"state": true}', self._address)
                    state = json.loads(channel.recv(65536))
                except OSError:  # it has not begun, or has ended
                    continue
                self.rows.append((0.5 * (began + time.monotonic()), *state["position"]))
                self.crashed = state["crashed"]

    def rms(self, wanted):
        """RMS of the horizontal distance from wanted places (time, north, east), m."""
        times, north, east, _ = np.array(self.rows).T
        at, *places = np.array(wanted).T
        off = [
            np.interp(at, times, true) - place
            for true, place in zip((north, east), places, strict=True)
        ]
        return float(np.sqrt(np.mean(np.square(off).sum(axis=0))))
