"""Ends the worker processes of a command when the command ends, even if it is killed."""

import ctypes
import signal

_PR_SET_PDEATHSIG = 1
_libc = ctypes.CDLL(None)


def end_with_parent() -> None:
    """Have the kernel kill this process when its parent ends (Linux only).

    A parent that is killed cannot end its children, and these would wait for work for ever.
    """
    _libc.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
