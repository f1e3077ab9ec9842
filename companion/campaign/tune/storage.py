"""Errors of the search's storage, an SQLite file that Optuna reads and writes."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class StorageError(Exception):
    """The storage is damaged or cannot be written; the message gives the reason."""


@contextmanager
def storage_errors(path: Path) -> Iterator[None]:
    """In the context, turn the errors of the storage at `path` into a `StorageError`.

    Optuna wraps SQLAlchemy's errors in its own, and their text only guesses at the cause.
    """
    from optuna.exceptions import StorageInternalError  # noqa: PLC0415  an extra
    from sqlalchemy.exc import DBAPIError  # noqa: PLC0415  comes with Optuna

    try:
        yield
    except (DBAPIError, StorageInternalError) as error:
        cause = error.__cause__ if isinstance(error, StorageInternalError) else error
        reason = cause.orig if isinstance(cause, DBAPIError) else cause
        raise StorageError(f"{path}: cannot be used: {reason}") from error
