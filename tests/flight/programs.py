"""Starts `companion` and mock vehicles out of a process that has imported them once.

There is a program or two for almost every flight over sockets, and half the cost of a short one was
its imports. Whether a program starts at all is tested by `tests/cli` and `tests/mock`, which start
each command as users do.
"""

import multiprocessing
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import redirect_stderr, redirect_stdout
from importlib import import_module
from io import StringIO
from multiprocessing.connection import Connection
from pathlib import Path

from companion.files.yaml_file import ConfigError
from companion.mavlink import lockstep
from sitl_mock import __main__ as command_line
from sitl_mock import server

PRELOADED = ("companion.cli.run", "companion.cli.flights", "companion.cli.identify")
"""What `companion` imports only when a command needs it."""

_CONTEXT = multiprocessing.get_context("forkserver")
_CONTEXT.set_forkserver_preload([__name__, *PRELOADED])


def start_mock(arguments: list[str], words: Path):
    """`python -m sitl_mock` with these arguments, in a process of its own; `words` is its output.

    Returns:
        the `multiprocessing` process, running.
    """
    process = _CONTEXT.Process(target=_run_mock, args=(arguments, words), daemon=True)
    process.start()
    return process


def _run_mock(arguments, words):
    with words.open("wb") as file:
        for stream in (sys.stdout, sys.stderr):
            os.dup2(file.fileno(), stream.fileno())
    _leave_cores()
    sys.exit(command_line.main(arguments))


def _leave_cores():
    """No program waits by polling: the cores are busy with other flights."""
    server.SPIN_S = lockstep._BUSY_WAIT_S = 0.0


def checked_here(config: Path) -> None:
    """What `companion check-config` lets the mock vehicle check, without a process for it."""
    words = StringIO()
    with redirect_stdout(words), redirect_stderr(words):
        code = command_line.main(["--check", "--config", str(config)])
    if code != 0:
        raise ConfigError(words.getvalue())


class Program:
    """A program in a process of its own, as `subprocess.Popen` shows it, with pipes for its output.

    Args:
        module: module whose `main()` is the program, such as `companion.cli.main`.
        arguments: arguments of the command line.
        environment: variables that differ from this process's.
        folder: working folder; None: this process's.
    """

    def __init__(
        self, module: str, *arguments: object, environment=None, folder: Path | None = None
    ):
        readers, writers = zip(*(_CONTEXT.Pipe(duplex=False) for _ in range(2)), strict=True)
        typed = [str(each) for each in arguments]
        variables = {**os.environ, **(environment or {})}
        told = module, typed, variables, str(folder or Path.cwd()), writers
        self._process = _CONTEXT.Process(target=_run, args=told)
        self._process.start()
        for writer in writers:
            writer.close()
        self.stdout, self.stderr = (_text(reader) for reader in readers)

    @property
    def pid(self) -> int:
        return self._process.pid

    @property
    def returncode(self) -> int | None:
        return self._process.exitcode

    def poll(self) -> int | None:
        return self._process.exitcode

    def wait(self, timeout: float | None = None) -> int:
        self._process.join(timeout)
        if self.returncode is None:
            raise subprocess.TimeoutExpired("the program", timeout)
        return self.returncode

    def send_signal(self, number: int) -> None:
        if self.poll() is None:
            os.kill(self.pid, number)

    def terminate(self) -> None:
        self.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        self.send_signal(signal.SIGKILL)

    def communicate(self, timeout: float | None = None) -> tuple[str, str]:
        """What it printed until its end, to standard output and to standard error."""
        with ThreadPoolExecutor(2) as pool:
            out, err = pool.map(_rest, (self.stdout, self.stderr))
        self.wait(timeout)
        return out, err


def _text(reader: Connection):
    stream = os.fdopen(os.dup(reader.fileno()), encoding="utf-8")
    reader.close()
    return stream


def _rest(stream) -> str:
    if stream.closed:
        return ""
    with stream:
        return stream.read()


def _run(module, arguments, environment, folder, writers):
    """The program itself, in its process."""
    for number, writer in enumerate(writers, start=1):
        os.dup2(writer.fileno(), number)
        writer.close()
    # Those of the process we come from believe that they may seek.
    sys.stdout = os.fdopen(1, "w", closefd=False)
    sys.stderr = os.fdopen(2, "w", buffering=1, closefd=False)
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder)
    sys.argv = [module, *arguments]
    _leave_cores()
    main: Callable[[], int] = import_module(module).main
    sys.exit(main())
