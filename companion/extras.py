"""Checks for optional packages, with the error message for a missing one."""

import importlib.util
import shlex
import sys
from pathlib import Path

_CLONE_FOLDER = Path(__file__).parents[1]
"""The folder of pyproject.toml, if the program runs from a clone."""


class MissingExtraError(Exception):
    """An optional package that is needed is not installed; the message says how to install it."""


def require(module: str, extra: str, purpose: str) -> None:
    """Check that an optional package is installed.

    Args:
        module: name of a module in the package.
        extra: the extra of this project that installs the package.
        purpose: the feature that needs the package; the message begins with it.

    Raises:
        MissingExtraError: the package is not installed.
    """
    if importlib.util.find_spec(module) is None:
        raise MissingExtraError(f"{purpose} needs {module}; install it with: {pip_command(extra)}")


def pip_command(extra: str) -> str:
    """The shell command that installs an extra into the environment that runs this program."""
    in_clone = (_CLONE_FOLDER / "pyproject.toml").is_file()
    requirement = (
        f"-e '{_path_as_typed(_CLONE_FOLDER)}[{extra}]'"
        if in_clone
        else f"'mavlink-companion[{extra}]'"
    )
    return f"{shlex.quote(_path_as_typed(Path(sys.executable)))} -m pip install {requirement}"


def _path_as_typed(path: Path) -> str:
    """A path as a user in the working folder would write it."""
    folder = Path.cwd()
    return str(path.relative_to(folder)) if path.is_relative_to(folder) else str(path)
