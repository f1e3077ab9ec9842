"""The worker processes of a command: how many run at a time, and which signals reach them."""

import ctypes
import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker

_PR_SET_PDEATHSIG = 1
_libc = ctypes.CDLL(None)


def usable_cores() -> int:
    """Number of processor cores that this process may use."""
    return len(os.sched_getaffinity(0))


def end_with_parent(parent_pid: int) -> None:
    """Have the kernel kill this process when its parent ends (Linux only).

    A parent that is killed cannot end its children, and they would wait for work for ever.

    Args:
        parent_pid: process id of the parent. If the parent has already ended, for example while
            this process imported its modules, this process ends at once.
    """
    _libc.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent_pid:
        signal.raise_signal(signal.SIGKILL)


@contextmanager
def interrupts_blocked() -> Iterator[None]:
    """Block SIGINT and SIGHUP in this thread, and in threads and processes that start in the block.

    Ctrl-C in a terminal, and a terminal that closes, signal all processes. Only the command's main
    process acts on these signals, and ends the workers.
    """
    previous_mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGHUP})
    try:
        resource_tracker.ensure_running()  # it would unblock SIGINT
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, previous_mask)
