"""The shell command that starts this program, for messages that suggest a command."""

import shlex
import shutil
import sys
from pathlib import Path


def program_command() -> str:
    """The shell command that starts this program again."""
    program = Path(sys.argv[0])
    if program.name != "companion":  # `python -m companion`
        return f"{shlex.quote(sys.executable)} -m companion"
    return "companion" if shutil.which("companion") == str(program) else shlex.quote(str(program))
