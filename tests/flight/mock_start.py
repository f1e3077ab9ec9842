"""Starts mock vehicles out of a process that has imported them once.

There is a mock for almost every flight, and half the cost of a short one was its imports.
"""

import multiprocessing
import os
import sys
from pathlib import Path

from sitl_mock import __main__ as command_line
from sitl_mock import server

_CONTEXT = multiprocessing.get_context("forkserver")
_CONTEXT.set_forkserver_preload([__name__])


def start(arguments: list[str], words: Path):
    """`python -m sitl_mock` with these arguments, in a process of its own; `words` is its output.

    Returns:
        the `multiprocessing` process, running.
    """
    process = _CONTEXT.Process(target=_run, args=(arguments, words), daemon=True)
    process.start()
    return process


def _run(arguments, words):
    with words.open("wb") as file:
        for stream in (sys.stdout, sys.stderr):
            os.dup2(file.fileno(), stream.fileno())
    server.SPIN_S = 0.0  # the cores are busy with other flights
    sys.exit(command_line.main(arguments))
