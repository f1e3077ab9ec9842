"""The solver as a flight sees it: a process that is asked, and answers when it can.

Nothing here blocks and nothing computes: a busy thread in our own process would keep the control
loop from its samples for milliseconds.
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
from pathlib import Path
from time import monotonic
from typing import NamedTuple

from companion.attitude.kinematics import tilt_products
from companion.guidance.trajectory.sample import Trajectory
from companion.nmpc.messages import READY, Answer, Request, Status, pack_request, unpack_answer
from companion.nmpc.settings import Settings
from companion.nmpc.solvers import check
from companion.realtime import schedule_as_usual

_LARGEST_MESSAGE = 4096
_LAST_MOMENT = 0.02
"""Between the end of a process's socket and that of the process, s; usually well below 1 ms."""
_TOLERANCE = 0.02
"""By which share an answer may be beyond a limit and count as rounding."""


class Trouble(Enum):
    """Why there is no solution to fly."""

    DIED = "died"
    LATE = "late"
    FAILED = "failed"
    ABSURD = "absurd"


Report = Callable[[Trouble, str], None]
"""Takes what went wrong, and the whole of it in words."""


class _Asked(NamedTuple):
    """The request that is out.

    Attributes:
        number: its own.
        at: when it was sent, on the machine's monotonic clock, s.
        longest: the longest coefficients that an answer may have.
    """

    number: int
    at: float
    longest: float


class Solver:
    """Starts the process, sends requests, hands out answers that may be flown.

    An answer that is late, failed or absurd is reported and not handed out; so is the death of the
    process, at the next call or, for who watches `fileno`, at once.

    Args:
        settings: vehicle, horizon and solver.
        trajectory: what is followed; one solver follows one. It is pickled.
        report: called for each trouble, from within the method that notices it.
        python: the interpreter of the process; None is ours.

    Attributes:
        alive: whether the process has not been found dead, nor closed.
        pid: of the process.

    Raises:
        MissingExtraError: the solver is not installed there.
    """

    def __init__(
        self,
        settings: Settings,
        trajectory: Trajectory,
        report: Report,
        python: Path | None = None,
    ) -> None:
        check(settings.solver, python)
        self._settings = settings
        self._report = report
        self._asked: _Asked | None = None
        self._ready = False
        self._ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._ours.setblocking(False)
        # Files, not pipes: the process takes its time to read, and nobody reads its last words
        # before it ends.
        self._words = tempfile.TemporaryFile()  # noqa: SIM115  closed by close()
        with theirs, tempfile.TemporaryFile() as told:
            pickle.dump((settings, trajectory), told)
            told.seek(0)
            self._process = subprocess.Popen(
                [python or sys.executable, "-m", "companion.nmpc.worker", str(theirs.fileno())],
                stdin=told,
                stdout=self._words,
                stderr=self._words,
                pass_fds=[theirs.fileno()],
                env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
            )
        self.pid = self._process.pid
        schedule_as_usual(self.pid)  # it computes all the time, and must not have our priority
        self.alive = True

    @property
    def ready(self) -> bool:
        """Whether it is warm, and takes requests."""
        if not self._ready and self.alive:
            self._ready = self._receive() == READY
        return self._ready and self.alive

    def fileno(self) -> int:
        """Readable when an answer has come or the process has ended; `take` then."""
        return self._ours.fileno()

    def request(self, request: Request) -> None:
        """Ask, and do not wait. What was asked before and not answered yet is late with this.

        Nothing is asked of a process that is not `ready`.
        """
        if not self.ready:
            return
        self._give_up("was not answered before the next one")
        try:
            self._ours.send(pack_request(request))
        except BlockingIOError:
            self._report(Trouble.LATE, "the solver does not read its requests")
        except (BrokenPipeError, ConnectionResetError):
            self._bury()
        else:
            _, ax, ay = tilt_products(*request.vehicle.q)
            longest = max(sin(self._settings.max_tilt), 2.0 * hypot(ax, ay))
            self._asked = _Asked(request.number, monotonic(), longest)

    def take(self, wait: float = 0.0) -> Answer | None:
        """The answer to the last request, once, if it has come and may be flown.

        Args:
            wait: for so long for it, s. In a flight in real time 0: this call then never blocks.
        """
        until = monotonic() + wait
        while self.ready:
            message = self._receive(max(0.0, until - monotonic()) if self._asked else 0.0)
            if not message:
                break
            answer = unpack_answer(message)
            if self._asked is not None and answer.number == self._asked.number:
                asked, self._asked = self._asked, None
                return self._checked(asked, answer)
        if self._asked is not None and monotonic() - self._asked.at > self._settings.deadline:
            self._give_up(f"has no answer after {1e3 * self._settings.deadline:.0f} ms")
        return None

    def close(self) -> None:
        """End the process."""
        if self.alive:
            self.alive = False
            self._ours.close()
            self._process.kill()
            self._process.wait()
            self._words.close()

    def _receive(self, wait: float = 0.0) -> bytes:
        """The next message; empty if there is none, or none any more."""
        if wait > 0.0:
            select.select([self._ours], [], [], wait)
        try:
            message = self._ours.recv(_LARGEST_MESSAGE)
        except BlockingIOError:
            return b""
        except ConnectionResetError:
            message = b""
        if not message:
            self._bury()
        return message

    def _checked(self, asked: _Asked, answer: Answer) -> Answer | None:
        took = answer.given_at - asked.at
        if took > self._settings.deadline:
            self._report(Trouble.LATE, f"request {asked.number} took {1e3 * took:.1f} ms")
        elif answer.status is not Status.SOLVED:
            words = f"request {asked.number} was not solved: {answer.status.name.lower()}"
            self._report(Trouble.FAILED, words)
        elif absurd := _absurdity(answer, asked.longest, self._settings):
            self._report(Trouble.ABSURD, f"the answer to request {asked.number} has {absurd}")
        else:
            return answer
        return None

    def _give_up(self, why: str) -> None:
        """Wait no more for the request that is out, if there is one."""
        if self._asked is not None:
            self._report(Trouble.LATE, f"request {self._asked.number} {why}")
            self._asked = None

    def _bury(self) -> None:
        """The other end is closed: see why."""
        with suppress(subprocess.TimeoutExpired):  # it closed its end, so it is as good as gone
            self._process.wait(_LAST_MOMENT)
        code = self._process.returncode
        self._words.seek(0)
        words = self._words.read().decode(errors="replace").strip().splitlines()
        self.close()
        self._asked = None
        how = f"was ended by signal {-code}" if code is not None and code < 0 else "has ended"
        self._report(Trouble.DIED, f"the solver {how}" + (f": {words[-1]}" if words else ""))


def _absurdity(answer: Answer, longest: float, settings: Settings) -> str | None:
    """What no vehicle can fly of an answer, in words; None if there is nothing."""
    values = (answer.north, answer.east, answer.heading, answer.thrust, answer.time)
    if not all(isfinite(value) for value in values):
        return "a number that is not finite"
    length = hypot(answer.north, answer.east)
    if length > (1.0 + _TOLERANCE) * longest:
        return f"coefficients of length {length:.3f}, at most {longest:.3f} can be flown"
    slack = _TOLERANCE * settings.gravity
    if not settings.min_thrust - slack <= answer.thrust <= settings.max_thrust + slack:
        return f"a thrust of {answer.thrust:.2f} m/s²"
    return None
