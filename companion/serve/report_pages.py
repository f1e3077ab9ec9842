"""The report pages of flights under a client's control, each written by a separate process."""

import os
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

from companion.program_command import no_report_text
from companion.realtime import use_normal_scheduler

_PAGE_TIMEOUT = 120.0
"""Time allowed for one page, s; a small computer needs about ten seconds."""
_CHECK_PERIOD = 1.0
"""Period of the checks whether the program ends or the page takes too long, s."""
_NICENESS = 19
"""Niceness of the process, so that it yields to a flight that has begun meanwhile."""
_INTERRUPTED = "interrupted"


class ReportPages:
    """Writes pages one after the other. `write` is called in threads outside the event loop."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._process: subprocess.Popen[str] | None = None
        self._is_stopping = False

    def write(self, folder: Path) -> str:
        """Write `report.html` about the flight in `folder`.

        Returns:
            A sentence with the path of the page, or with the reason why there is none.
        """
        with self._lock:
            try:
                return f"Report: {self._run_report(folder)}"
            except (OSError, RuntimeError) as error:
                return no_report_text(error, folder)

    def stop(self) -> None:
        """Write no further page, because the program ends."""
        self._is_stopping = True
        if self._process is not None:
            self._process.kill()

    def _run_report(self, folder: Path) -> str:
        """Start the process, wait until it has written the page, and return the page's path.

        Raises:
            OSError: the process cannot be started.
            RuntimeError: the process wrote no page; the message says why.
        """
        if self._is_stopping:
            raise RuntimeError(_INTERRUPTED)
        self._process = subprocess.Popen(
            [sys.executable, "-m", "companion", "report", str(folder)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,  # Ctrl-C must reach only this program
        )
        _lower_priority(self._process.pid)
        output, errors = self._wait_for_output(self._process)
        if self._process.returncode != 0:
            exit_text = f"its process ended with exit code {self._process.returncode}"
            raise RuntimeError(" ".join(errors.split()) or exit_text)
        return output.strip()

    def _wait_for_output(self, process: "subprocess.Popen[str]") -> tuple[str, str]:
        """Return the output of the process when it has ended.

        Raises:
            RuntimeError: the program ends, or the page takes too long. The process is killed
                without waiting for its end, because it may be blocked by a disk that hangs.
        """
        deadline = time.monotonic() + _PAGE_TIMEOUT
        while True:
            with suppress(subprocess.TimeoutExpired):
                output = process.communicate(timeout=_CHECK_PERIOD)
                if not self._is_stopping:
                    return output
            if self._is_stopping or time.monotonic() > deadline:
                process.kill()
                late_text = f"the page was not written within {_PAGE_TIMEOUT:g} s"
                raise RuntimeError(_INTERRUPTED if self._is_stopping else late_text)


def _lower_priority(pid: int) -> None:
    """Give a process the normal scheduler and the lowest priority instead of the flight's."""
    use_normal_scheduler(pid)
    with suppress(ProcessLookupError):  # it has ended already
        os.setpriority(os.PRIO_PROCESS, pid, _NICENESS)
