"""The program's entry point. Exit codes: 0 success, 1 failed or interrupted, 2 usage error.

This module imports almost nothing before it handles signals: the other imports take most of a
second.
"""

from __future__ import annotations

import os
import signal
import sys

from companion.cli import interrupts
from companion.cli.exit_codes import EXIT_FAILURE

TYPE_CHECKING = False  # type checkers take it for typing's, whose import would cost 5 ms
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command, by default with the arguments of this process; return the exit code."""
    if arguments is None:
        _use_utf8_names()
    our_signals = interrupts.signals_with_default_handler()
    interrupts.exit_on(our_signals)
    try:
        try:
            run = _load_command(arguments)
        finally:
            interrupts.raise_interrupt_on(our_signals)
        return run()
    except KeyboardInterrupt:
        sys.stderr.write("companion: interrupted\n")
        return EXIT_FAILURE
    finally:
        interrupts.restore_default_handlers(our_signals)
        if arguments is None and signal.SIGINT in our_signals:  # Ctrl-C may end Python's shutdown
            signal.signal(signal.SIGINT, signal.SIG_DFL)


def _use_utf8_names() -> None:
    """Start this process again in Python's UTF-8 mode if its locale knows only ASCII file names.

    With `LC_ALL=C`, `PYTHONCOERCECLOCALE=0` and `PYTHONUTF8=0`, as some service managers and shells
    set them, Python cannot open a file with a name such as `flüge`. The encoding of the output does
    not change. If the restart fails, the process continues in its locale.
    """
    if sys.getfilesystemencoding() not in ("ascii", "us-ascii") or not sys.executable:
        return
    encoding = os.environ.get("PYTHONIOENCODING") or getattr(sys.stdout, "encoding", None)
    environment = {**os.environ, "PYTHONUTF8": "1", "PYTHONIOENCODING": encoding or "ascii"}
    try:
        os.execve(sys.executable, [sys.executable, "-X", "utf8", *sys.orig_argv[1:]], environment)
    except OSError:
        return


def _load_command(arguments: Sequence[str] | None) -> Callable[[], int]:
    """Parse the arguments and import their command; return a function that runs it."""
    # Our matrices are small: a second thread takes twice the CPU time and is slower.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from companion.cli.text_streams import flush_output, transliterate_output  # noqa: PLC0415

    transliterate_output()
    from companion.cli.command_line import parse  # noqa: PLC0415

    try:
        options = parse(arguments)
    finally:
        flush_output()  # so that Python reports no error if the help is cut off, as by `| head`
    from companion.cli.run import command_of, run  # noqa: PLC0415

    command = command_of(options)
    return lambda: run(command, options)
