"""Checks for optional packages, with the error message for a missing one."""

import importlib.util


class MissingExtraError(Exception):
    """An optional package that is needed is not installed; the message says how to install it."""


def require(module: str, extra: str, purpose: str) -> None:
    """Check that an optional package is installed.

    Args:
        module: the module to import.
        extra: the extra of this project that installs it.
        purpose: what needs the package; the message begins with it.

    Raises:
        MissingExtraError: the package is not installed.
    """
    if importlib.util.find_spec(module) is None:
        raise MissingExtraError(
            f"{purpose} needs {module}; install it with: pip install 'mavlink-companion[{extra}]'"
            f" (in a clone: pip install -e '.[{extra}]')"
        )
