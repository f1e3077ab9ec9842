"""The report pages of served flights, each written by a process of its own."""

import os
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

from companion.realtime import schedule_as_usual

_LONGEST = 120.0
"""Time allowed for one page, s; a small computer needs some ten seconds."""
_LOOK_PERIOD = 1.0
"""Period of asking whether to go on waiting for the process, s."""
_NICE = 19
"""The process gives way to everything else: the next flight may have begun."""
_INTERRUPTED = "interrupted"


class ReportPages:
    """Writes pages, one after the other. `write` is called in threads beside the event loop."""

    def __init__(self) -> None:
        self._turn = threading.Lock()
        self._process: subprocess.Popen[str] | None = None
        self._left = False

    def write(self, folder: Path) -> str:
        """Write `report.html` about the flight in `folder`; returns where it is, or why not."""
        with self._turn:
            try:
                return f"Report: {self._written(folder)}"
            except (OSError, RuntimeError) as error:
                return f"No report: {error}; `companion report {folder}` tries again"

    def leave(self) -> None:
        """Write no page any more: the program is to end."""
        self._left = True
        if self._process is not None:
            self._process.kill()

    def _written(self, folder: Path) -> str:
        """The path of the page, once the process has written it.

        Raises:
            OSError: the process cannot be started.
            RuntimeError: it wrote no page; the message says why.
        """
        if self._left:
            raise RuntimeError(_INTERRUPTED)
        self._process = subprocess.Popen(
            [sys.executable, "-m", "companion", "report", str(folder)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,  # a Ctrl-C is for the program, which says what becomes of it
        )
        _give_way(self._process.pid)
        out, errors = self._output(self._process)
        if self._process.returncode != 0:
            raise RuntimeError(" ".join(errors.split()) or f"exit {self._process.returncode}")
        return out.strip()

    def _output(self, process: "subprocess.Popen[str]") -> tuple[str, str]:
        """What the process printed, once it has ended.

        Raises:
            RuntimeError: it was not waited for any longer. It is killed, but its end is not waited
                for, because on a disk that hangs no process ends.
        """
        deadline = time.monotonic() + _LONGEST
        while True:
            with suppress(subprocess.TimeoutExpired):
                told = process.communicate(timeout=_LOOK_PERIOD)
                if not self._left:
                    return told
            if self._left or time.monotonic() > deadline:
                process.kill()
                late = f"it was not written within {_LONGEST:g} s"
                raise RuntimeError(_INTERRUPTED if self._left else late)


def _give_way(pid: int) -> None:
    """Take the flight's real-time priority from a process, and all but the lowest of its own."""
    schedule_as_usual(pid)
    with suppress(ProcessLookupError):  # it has ended already
        os.setpriority(os.PRIO_PROCESS, pid, _NICE)
