"""Errors of code that runs in a flight but is not part of this program: the user's, or a plug-in's.

Planners and guidance of other packages, and trajectories of a user's program, are called in one
place each, within `naming_user_code`.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from traceback import walk_tb

MESSAGE_START = "an error outside this program: "
"""Beginning of the message of each `UserCodeError`."""

_OUR_PACKAGE = __name__.partition(".")[0]
_MAX_TEXT_LENGTH = 300
"""Largest number of characters of the user code's error that are shown."""


class UserCodeError(Exception):
    """User code raised an error; the message is for the user and names the code and the place."""


@contextmanager
def naming_user_code(
    role: str, code: object, *passed_errors: type[BaseException]
) -> Iterator[None]:
    """Convert an error that user code raises in the block to one that names the code.

    An error of an object of this program, such as a trajectory made by `slow_down`, is raised
    unchanged, unless the object contains a trajectory of the user.

    Args:
        role: role of the code in the flight, such as "trajectory".
        code: the object or function that is called in the block.
        passed_errors: errors that the code may raise; they are raised unchanged.

    Raises:
        UserCodeError: the code raised anything else, also SystemExit or CancelledError, which would
            end the event loop or the guidance of the flight.
    """
    unchanged_errors: tuple[type[BaseException], ...] = (
        KeyboardInterrupt,
        UserCodeError,
        *passed_errors,
    )
    try:
        yield
    except unchanged_errors:
        raise
    except BaseException as error:
        code = _innermost_trajectory(code)
        # A function has a name; of another object, the class is named.
        source = code if hasattr(code, "__qualname__") else type(code)
        package = _package(source.__module__)
        if package == _OUR_PACKAGE:
            raise
        text = " ".join(f"{type(error).__name__}: {error}".removesuffix(": ").split())
        raise UserCodeError(
            f"an error outside this program: the {role} {source.__qualname__} of the module "
            f"{source.__module__} raised {text[:_MAX_TEXT_LENGTH]}{_error_place(package, error)}"
        ) from error


def _innermost_trajectory(code: object) -> object:
    """The user's trajectory that `code`, a trajectory of this program, wraps; else `code`."""
    while _package(type(code).__module__) == _OUR_PACKAGE and hasattr(code, "trajectory"):
        code = code.trajectory
    return code


def _error_place(package: str, error: BaseException) -> str:
    """File and line of the innermost call in a package, in brackets; empty if there is none."""
    places = [
        f" ({frame.f_code.co_filename}:{line})"
        for frame, line in walk_tb(error.__traceback__)
        if _package(frame.f_globals.get("__name__", "")) == package
    ]
    return places[-1] if places else ""


def _package(module: str) -> str:
    return module.partition(".")[0]
