"""Packages that only some commands need, and the one sentence for when they are missing."""

import importlib.util


class MissingExtraError(Exception):
    """A command needs a package that is not installed; the message says how to get it."""


def require(module: str, extra: str, purpose: str) -> None:
    """Make sure that an optional package is there, before anything is begun.

    Args:
        module: what would be imported.
        extra: the extra of this project that installs it.
        purpose: what needs it, as the beginning of a sentence.

    Raises:
        MissingExtraError: it is not installed.
    """
    if importlib.util.find_spec(module) is None:
        raise MissingExtraError(
            f"{purpose} needs {module}; install it with: pip install 'mavlink-companion[{extra}]'"
            f" (in a clone: pip install -e '.[{extra}]')"
        )
