"""The flight's interface to the solver's process: sends requests and takes the answers.

The solver runs in another process, because a busy thread in the flight's process would delay the
control loop by milliseconds. The flight never waits here for the solver, except in lockstep, and
for up to 20 ms when that process ends.
"""

import os
import pickle
import select
import socket
import subprocess
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from enum import Enum
from math import hypot, isfinite, sin
from time import monotonic
from typing import NamedTuple

from companion.attitude.kinematics import half_tilt_products
from companion.extras import require
from companion.guidance.trajectory.sample import Trajectory
from companion.nmpc.messages import READY_MESSAGE, Answer, Request, Status
from companion.nmpc.settings import Settings
from companion.realtime import use_normal_scheduler

_LARGEST_MESSAGE = 4096  # bytes
_EXIT_TIMEOUT = 0.02
"""Time allowed for the process to exit after its socket has closed, s; it usually takes < 1 ms."""
_ANSWER_TOLERANCE = 0.02
"""Margin for rounding when an answer is checked, as a share of the tilt limit and of gravity."""


class Trouble(Enum):
    """Why the solver gave no usable answer."""

    DIED = "died"
    """The process has ended."""
    LATE = "late"
    """No answer came within the deadline, or before the next request."""
    FAILED = "failed"
    """The answer says that the problem was not solved."""
    IMPLAUSIBLE = "implausible"
    """The answer has a number that is not finite, or exceeds the limits of tilt or thrust."""


ReportTrouble = Callable[[Trouble, str], None]
"""Called with the kind of trouble and a description."""


class _PendingRequest(NamedTuple):
    """The request that has no answer yet."""

    number: int
    sent_at: float
    """Time at which the request was sent, on the computer's monotonic clock, s."""
    longest_target: float
    """Largest length of the target coefficients that the answer may have."""


class Solver:
    """Starts the solver's process, sends requests, returns usable answers.

    An answer that is late, failed or implausible is reported and not returned. The end of the
    process is reported at the next call.

    Args:
        trajectory: the trajectory to follow; it is pickled.
        report: called with each trouble, by the method that notices it.

    Attributes:
        alive: False after `close`, or after the end of the process was noticed.
        pid: process id of the solver.

    Raises:
        MissingExtraError: CasADi is not installed.
    """

    def __init__(self, settings: Settings, trajectory: Trajectory, report: ReportTrouble) -> None:
        require("casadi", "nmpc", "Predictive control")
        self._settings = settings
        self._report = report
        self._pending_request: _PendingRequest | None = None
        self._has_started = False
        self._socket, worker_socket = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._socket.setblocking(False)
        # Files instead of pipes, which could fill up: the process reads its input late, and its
        # output is read only after it has ended.
        self._output = tempfile.TemporaryFile()  # noqa: SIM115  closed by close()
        with worker_socket, tempfile.TemporaryFile() as job_file:
            pickle.dump((settings, trajectory), job_file)
            job_file.seek(0)
            self._process = subprocess.Popen(
                [sys.executable, "-m", "companion.nmpc.worker", str(worker_socket.fileno())],
                stdin=job_file,
                stdout=self._output,
                stderr=self._output,
                pass_fds=[worker_socket.fileno()],
                env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
            )
        self.pid = self._process.pid
        use_normal_scheduler(self.pid)  # without real-time priority, because it always computes
        self.alive = True

    @property
    def ready(self) -> bool:
        """Whether the process has started and takes requests."""
        if not self._has_started and self.alive:
            self._has_started = self._receive() == READY_MESSAGE
        return self._has_started and self.alive

    def request(self, request: Request) -> None:
        """Send a request without waiting; an earlier request without an answer counts as late.

        If the process is not `ready`, the request is dropped.
        """
        if not self.ready:
            return
        self._drop_pending("was not answered before the next one")
        try:
            self._socket.send(pickle.dumps(request))
        except BlockingIOError:
            self._report(Trouble.LATE, "the solver does not read its requests")
        except (BrokenPipeError, ConnectionResetError):
            self._handle_exit()
        else:
            _, ax, ay = half_tilt_products(*request.vehicle.q)
            longest_target = max(sin(self._settings.max_tilt), 2.0 * hypot(ax, ay))
            self._pending_request = _PendingRequest(request.number, monotonic(), longest_target)

    def take_answer(self, timeout: float = 0.0) -> Answer | None:
        """The answer to the last request if it has arrived and is usable; else None.

        Each answer is returned once.

        Args:
            timeout: longest time to wait for the answer, s. In real time use 0: the call returns at
                once.
        """
        deadline = monotonic() + timeout
        while self.ready:
            message = self._receive(
                max(0.0, deadline - monotonic()) if self._pending_request else 0.0
            )
            if not message:
                break
            answer: Answer = pickle.loads(message)  # trusted: this program started the process
            if self._pending_request is not None and answer.number == self._pending_request.number:
                pending, self._pending_request = self._pending_request, None
                return self._usable_answer(pending, answer)
        if (
            self._pending_request is not None
            and monotonic() - self._pending_request.sent_at > self._settings.deadline
        ):
            self._drop_pending(f"has no answer after {1e3 * self._settings.deadline:.0f} ms")
        return None

    def close(self) -> None:
        """End the process."""
        if self.alive:
            self.alive = False
            self._socket.close()
            self._process.kill()
            self._process.wait()
            self._output.close()

    def _receive(self, timeout: float = 0.0) -> bytes:
        """The next message; empty if there is none, or if the process has ended."""
        if timeout > 0.0:
            select.select([self._socket], [], [], timeout)
        try:
            message = self._socket.recv(_LARGEST_MESSAGE)
        except BlockingIOError:
            return b""
        except ConnectionResetError:
            message = b""
        if not message:
            self._handle_exit()
        return message

    def _usable_answer(self, pending: _PendingRequest, answer: Answer) -> Answer | None:
        """The answer if it is usable; otherwise report the trouble and return None."""
        elapsed = answer.computed_at - pending.sent_at
        if elapsed > self._settings.deadline:
            self._report(Trouble.LATE, f"request {pending.number} took {1e3 * elapsed:.1f} ms")
        elif answer.status is not Status.SOLVED:
            reason = answer.status.name.lower().replace("_", " ")
            message = f"request {pending.number} was not solved: {reason}"
            self._report(Trouble.FAILED, message)
        elif why_implausible := _why_implausible(answer, pending.longest_target, self._settings):
            self._report(
                Trouble.IMPLAUSIBLE, f"the answer to request {pending.number} has {why_implausible}"
            )
        else:
            return answer
        return None

    def _drop_pending(self, reason: str) -> None:
        """Report the pending request as late, if there is one."""
        if self._pending_request is not None:
            self._report(Trouble.LATE, f"request {self._pending_request.number} {reason}")
            self._pending_request = None

    def _handle_exit(self) -> None:
        """Report how the process ended, after it has closed its socket."""
        with suppress(subprocess.TimeoutExpired):  # if it hangs, `close` kills it
            self._process.wait(_EXIT_TIMEOUT)
        exit_code = self._process.returncode
        self._output.seek(0)
        output = self._output.read().decode(errors="replace").strip().splitlines()
        self.close()
        self._pending_request = None
        exit_text = (
            f"was ended by signal {-exit_code}"
            if exit_code is not None and exit_code < 0
            else "has ended"
        )
        self._report(
            Trouble.DIED, f"the solver {exit_text}" + (f": {output[-1]}" if output else "")
        )


def _why_implausible(answer: Answer, longest_target: float, settings: Settings) -> str | None:
    """Reason why an answer is implausible; None if it is plausible."""
    values = (answer.north, answer.east, answer.heading, answer.thrust, answer.time)
    if not all(isfinite(value) for value in values):
        return "a number that is not finite"
    length = hypot(answer.north, answer.east)
    if length > (1.0 + _ANSWER_TOLERANCE) * longest_target:
        return f"coefficients of length {length:.3f}, more than the limit {longest_target:.3f}"
    tolerance = _ANSWER_TOLERANCE * settings.gravity
    if not settings.min_thrust - tolerance <= answer.thrust <= settings.max_thrust + tolerance:
        limits_text = f"{settings.min_thrust:.2f} to {settings.max_thrust:.2f}"
        return f"a thrust of {answer.thrust:.2f} m/s², outside {limits_text}"
    return None
