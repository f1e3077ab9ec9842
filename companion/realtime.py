"""What is asked of the operating system so that the control loop is not kept waiting.

Everything is asked for the calling thread, which runs the event loop, or for the whole process;
nothing that is refused stops a flight, unless the user said so. Linux only, as the program is.
"""

import ctypes
import errno
import gc
import os
import resource
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from typing import NamedTuple

_MCL_CURRENT, _MCL_FUTURE = 1, 2
_HOW_FIFO = (
    "run it by docs/companion.service, or allow `rtprio` to its user in /etc/security/limits.conf"
)
_HOW_MEMORY = (
    "run it by docs/companion.service, or allow `memlock unlimited` to its user in "
    "/etc/security/limits.conf"
)


def schedule_as_usual(pid: int) -> None:
    """Take from a process that we have begun the priority that it has from us."""
    with suppress(ProcessLookupError):  # it has ended already
        os.sched_setscheduler(pid, os.SCHED_OTHER, os.sched_param(0))


class RealtimeError(Exception):
    """Something that was required is refused; the message says what, why, and how to get it."""


class Refused(Exception):  # noqa: N818 - it is no error of ours
    """The system does not grant it, with why and what to do."""


class Grant(NamedTuple):
    """One thing that was asked for.

    Attributes:
        name: its key in the section `realtime`.
        asked: what, for people.
        refusal: why it was not granted and how to get it; None if it was granted.
    """

    name: str
    asked: str
    refusal: str | None = None

    def __str__(self) -> str:
        if self.refusal is None:
            return f"realtime: {self.asked}: granted"
        return f"realtime: {self.asked}: not granted: {self.refusal}"


@dataclass(frozen=True, slots=True)
class Wishes:
    """What to ask for.

    Attributes:
        fifo_priority: of SCHED_FIFO, 1..99; None: leave the scheduler as it is.
        processors: numbers of those to run on; empty: any.
        lock_memory: keep all memory in RAM.
        freeze_gc: no garbage collection meanwhile.
        required: raise rather than go on without.
    """

    fifo_priority: int | None = None
    processors: tuple[int, ...] = ()
    lock_memory: bool = False
    freeze_gc: bool = False
    required: bool = False


@contextmanager
def asked_for(wishes: Wishes) -> Iterator[tuple[Grant, ...]]:
    """Ask for all wishes, and give back what was granted when the block ends.

    Raises:
        RealtimeError: something is refused, and all is required.
    """
    grants: list[Grant] = []
    with ExitStack() as undo:
        for name, asked, take in _steps(wishes):
            try:
                undo.callback(take())
                grants.append(Grant(name, asked))
            except Refused as refused:
                grants.append(Grant(name, asked, str(refused)))
        refusals = [str(grant) for grant in grants if grant.refusal is not None]
        if refusals and wishes.required:
            raise RealtimeError(f"{'; '.join(refusals)} (realtime.required is true)")
        yield tuple(grants)


_Undo = Callable[[], object]
_Take = Callable[[], _Undo]


def _steps(wishes: Wishes) -> Iterator[tuple[str, str, _Take]]:
    """What was wished for: its key, what to call it, and what takes it and tells how to undo it."""
    priority, processors = wishes.fifo_priority, wishes.processors
    if processors:
        numbers = ", ".join(map(str, processors))
        yield "cpu_affinity", f"processor {numbers}", lambda: _run_on(processors)
    if wishes.freeze_gc:
        yield "freeze_gc", "no garbage collection in flight", _stop_collecting
    if wishes.lock_memory:
        yield "lock_memory", "memory locked in RAM", _lock_memory
    if priority is not None:  # last: what the others take time for is not done at this priority
        yield "scheduler", f"SCHED_FIFO at priority {priority}", lambda: _take_fifo(priority)


def _take_fifo(priority: int) -> _Undo:
    before, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    # Threads that begin from here on (recording, MAVSDK) inherit it, and must: one that is kept
    # from the processor while it holds the interpreter would keep the loop waiting with it.
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except PermissionError:
        raise Refused(f"this user may not; {_HOW_FIFO}") from None
    except OSError as error:
        raise Refused(f"{error.strerror}") from None
    return lambda: os.sched_setscheduler(0, before, parameters)


def _run_on(processors: tuple[int, ...]) -> _Undo:
    before = os.sched_getaffinity(0)
    missing = [number for number in processors if number not in before]
    if missing:
        raise Refused(
            f"no processor {', '.join(map(str, missing))} for this program, which has "
            f"{', '.join(map(str, sorted(before)))}"
        )
    try:
        os.sched_setaffinity(0, processors)
    except OSError as error:
        raise Refused(f"{error.strerror}") from None
    return lambda: os.sched_setaffinity(0, before)


def _lock_memory() -> _Undo:
    libc = ctypes.CDLL(None, use_errno=True)
    limit, _ = resource.getrlimit(resource.RLIMIT_MEMLOCK)
    if limit != resource.RLIM_INFINITY and os.geteuid() != 0:
        # It may be enough for now; but then an allocation in flight would fail.
        raise Refused(f"this user may lock {limit // 1024} KiB only; {_HOW_MEMORY}")
    if libc.mlockall(_MCL_CURRENT | _MCL_FUTURE) != 0:
        number = ctypes.get_errno()
        if number in (errno.EPERM, errno.ENOMEM):
            raise Refused(f"{os.strerror(number)}; {_HOW_MEMORY}")
        raise Refused(os.strerror(number))
    return libc.munlockall


def _stop_collecting() -> _Undo:
    was_enabled = gc.isenabled()
    gc.collect()
    gc.freeze()
    gc.disable()

    def undo() -> None:
        gc.unfreeze()
        if was_enabled:
            gc.enable()

    return undo
