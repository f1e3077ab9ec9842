"""The mock and `companion serve` as processes."""

import contextlib
import json
import os
import signal
import subprocess
import sys
from pathlib import Path

from tests.mavlink.fakes import free_port

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
