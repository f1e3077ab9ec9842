"""A program under measurement, as a process of its own."""

import ctypes
import signal
import socket
import subprocess
import sys
import tempfile
from pathlib import Path

from companion.mavlink.errors import LinkError

_PR_SET_PDEATHSIG = 1
_libc = ctypes.CDLL(None)


class ContestantError(LinkError):
    """A program of the benchmark cannot take part."""


def free_port() -> int:
    """A UDP port that nobody uses at the moment."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as opened:
        opened.bind(("127.0.0.1", 0))
        return int(opened.getsockname()[1])


def _end_with_parent() -> None:
    """Have the kernel kill this process when its parent dies (Linux, like the rest of the bench).

    The programs answer until they are killed, and a benchmark that is killed cannot do it.
    """
    _libc.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)


class Contestant:
    """Starts `python -m MODULE PORT` and reads how much processor time it takes.

    Args:
        name: For people.
        module: A module that listens on the UDP port it is given.
    """

    def __init__(self, name: str, module: str) -> None:
        self.name = name
        self.port = free_port()
        # A file, not a pipe: nobody reads it meanwhile, and a full pipe would stop the program.
        self._words = tempfile.TemporaryFile()  # noqa: SIM115  closed by stop()
        self._process = subprocess.Popen(
            [sys.executable, "-m", module, str(self.port)],
            stdout=subprocess.DEVNULL,
            stderr=self._words,
            preexec_fn=_end_with_parent,  # noqa: PLW1509  the benchmark has one thread
        )

    def check_running(self) -> None:
        """Raise `ContestantError` with its last words if the program has ended."""
        if self._process.poll() is not None:
            self._words.seek(0)
            words = self._words.read().decode(errors="replace").strip().splitlines()
            raise ContestantError(f"{self.name} ended early: {words[-1] if words else 'no word'}")

    def cpu_ns(self) -> int:
        """Processor time of all its threads so far, ns (Linux: the scheduler's own count)."""
        tasks = Path(f"/proc/{self._process.pid}/task").iterdir()
        return sum(int((task / "schedstat").read_text().split()[0]) for task in tasks)

    def stop(self) -> None:
        """Kill it."""
        self._process.kill()
        self._process.wait()
        self._words.close()
