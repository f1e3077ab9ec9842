"""The program's entry. Exit codes: 0 success, 1 failed or interrupted, 2 usage or configuration.

It imports almost nothing before it handles signals: the other imports take most of a second.
"""

from __future__ import annotations

import os
import signal
import sys

from companion.cli import interrupts
from companion.cli.exit_codes import EXIT_FLIGHT

TYPE_CHECKING = False  # as typing's, which is not worth its 5 ms here
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit code.

    Args:
        arguments: arguments of the command line; None: those of this process.
    """
    ours = interrupts.unhandled()
    interrupts.leave_at_once(ours)
    try:
        try:
            run = _loaded(arguments)
        finally:
            interrupts.raise_interrupt(ours)
        return run()
    except KeyboardInterrupt:
        sys.stderr.write("companion: interrupted\n")
        return EXIT_FLIGHT
    finally:
        interrupts.restore(ours)
        if arguments is None and signal.SIGINT in ours:  # Ctrl-C may end the interpreter exit
            signal.signal(signal.SIGINT, signal.SIG_DFL)


def _loaded(arguments: Sequence[str] | None) -> Callable[[], int]:
    """Parse the arguments, and import the command they name."""
    # Our matrices are small: a second thread takes twice the CPU time and is slower.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from companion.cli.text_streams import lost_output, print_anything  # noqa: PLC0415

    print_anything()
    from companion.cli.command_line import parse  # noqa: PLC0415

    try:
        options = parse(arguments)
    finally:
        lost_output()  # help that is not read to its end is no error
    from companion.cli.run import command_of, run  # noqa: PLC0415

    command = command_of(options)
    return lambda: run(command, options)
