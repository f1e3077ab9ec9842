"""A process that runs one of the programs that are measured."""

import os
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path

from companion.child_process import end_with_parent
from companion.mavlink.errors import LinkError
from companion.mavlink.transport.free_port import free_port


class BenchmarkError(LinkError):
    """A measured program, or one of its clients, failed."""


class BenchmarkedProgram:
    """A program that is measured, run as `python -m MODULE PORT …` in its own process.

    Args:
        name: name to show to users.
        module: a module that listens on the UDP port given to it.
        arguments: further arguments of the module.
    """

    def __init__(self, name: str, module: str, *arguments: str) -> None:
        self.name = name
        self.port = free_port()
        # A file, not a pipe: nobody reads while the program runs, and a full pipe would block it.
        self._error_output = tempfile.TemporaryFile()  # noqa: SIM115  closed by stop()
        self._process = subprocess.Popen(
            [sys.executable, "-m", module, str(self.port), *arguments],
            stdout=subprocess.DEVNULL,
            stderr=self._error_output,
            preexec_fn=partial(end_with_parent, os.getpid()),  # noqa: PLW1509  the benchmark has one thread
        )

    def check_running(self) -> None:
        """Raise `BenchmarkError`, with the last line of error output, if the program has ended."""
        if self._process.poll() is not None:
            self._error_output.seek(0)
            error_lines = self._error_output.read().decode(errors="replace").strip().splitlines()
            reason = error_lines[-1] if error_lines else "it printed no error"
            raise BenchmarkError(f"{self.name} ended early: {reason}")

    def cpu_ns(self) -> int:
        """Processor time of all threads of the program so far, ns (Linux only)."""
        tasks = Path(f"/proc/{self._process.pid}/task").iterdir()
        return sum(int((task / "schedstat").read_text().split()[0]) for task in tasks)

    def stop(self) -> None:
        """Kill the program."""
        self._process.kill()
        self._process.wait()
        self._error_output.close()
