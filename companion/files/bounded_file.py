"""Reads a file that a user names: a regular file of limited size."""

import os
import stat
from pathlib import Path


class FileRefusedError(Exception):
    """A file cannot be used; the message continues a sentence that begins with the file's name."""


def read_text(path: Path, max_bytes: int) -> str:
    """Read a regular UTF-8 file of limited size, with or without a byte order mark.

    Devices and pipes are refused: they may block or never end.

    Raises:
        FileRefusedError: the file cannot be read, is not regular, too large, or not text.
    """
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        try:
            if not stat.S_ISREG(os.fstat(descriptor).st_mode):
                raise FileRefusedError("not a regular file")
            with os.fdopen(descriptor, "rb", closefd=False) as file:
                data = file.read(max_bytes + 1)
        finally:
            os.close(descriptor)
    except OSError as error:
        raise FileRefusedError(f"cannot read it: {error.strerror}") from error
    except ValueError as error:
        raise FileRefusedError("the name holds a character that no file name may hold") from error
    if len(data) > max_bytes:
        raise FileRefusedError(f"larger than {max_bytes / 1e6:g} MB")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileRefusedError("not a text file in UTF-8") from error
