"""Reading a file that a user names: a regular one, and no larger than it may be."""

import os
import stat
from pathlib import Path


class FileRefusedError(Exception):
    """A file cannot be taken; the message is the end of a sentence that begins with its name."""


def read_text(path: Path, most: int) -> str:
    """The text of a regular file in UTF-8, with or without a byte order mark.

    A device or a pipe may never end, or never begin: it is not opened to wait for.

    Args:
        path: of the file.
        most: bytes that it may have.

    Raises:
        FileRefusedError: it cannot be read, is no regular file, is larger, or is no text.
    """
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        try:
            if not stat.S_ISREG(os.fstat(descriptor).st_mode):
                raise FileRefusedError("not a regular file")
            with os.fdopen(descriptor, "rb", closefd=False) as file:
                data = file.read(most + 1)
        finally:
            os.close(descriptor)
    except OSError as error:
        raise FileRefusedError(f"cannot read it: {error.strerror}") from error
    except ValueError as error:
        raise FileRefusedError("no such file can be named") from error
    if len(data) > most:
        raise FileRefusedError(f"larger than {most / 1e6:g} MB")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileRefusedError("not a text file in UTF-8") from error
