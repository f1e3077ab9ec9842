"""The shell command that starts this program, for messages that suggest a command."""

import shlex
import shutil
import sys
from pathlib import Path


def program_command(*arguments: Path | str) -> str:
    """The shell command that starts this program again, with these arguments."""
    return " ".join([_program(), *(shlex.quote(str(argument)) for argument in arguments)])


def _program() -> str:
    program = Path(sys.argv[0])
    if program.name != "companion":  # `python -m companion`
        return f"{shlex.quote(sys.executable)} -m companion"
    return "companion" if shutil.which("companion") == str(program) else shlex.quote(str(program))


def no_report_text(reason: object, folder: Path | str) -> str:
    """A sentence for the user: why `folder` has no page about its flight, and how to write one."""
    return f"No report: {reason}; `{program_command('report', folder)}` tries again"
