"""Atomic writing of files: at any time a reader finds either the old or the new content."""

import errno
import os
import tempfile
import threading
import weakref
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

DISK_TIMEOUT = 5.0
"""Time allowed for the disk to take written data, s."""
DISK_HANGS = f"the disk did not answer for {DISK_TIMEOUT:g} s"
"""The reason in messages if the disk takes longer than `DISK_TIMEOUT`."""


def reason_of(error: OSError) -> str:
    """The system's reason without error number and file; the whole text if it gave no reason."""
    return error.strerror or str(error)


def file_and_reason(error: OSError) -> str:
    """The file of the error, if it is known, and the error's reason (`reason_of`)."""
    return f"{'' if error.filename is None else f'{error.filename}: '}{reason_of(error)}"


class ReservedSpace:
    """Disk space reserved for a file that is written later, when the disk may be full.

    An unnamed file holds the space, so the system frees it even if the process is killed.

    Attributes:
        free: releases the space, as does the deletion of this object.

    Args:
        folder: folder of the later file. If the disk is full, or the file system cannot reserve
            space, nothing is reserved.
        size: space to reserve, bytes.
    """

    def __init__(self, folder: Path, size: int) -> None:
        self.free: Callable[[], object] = lambda: None
        with suppress(OSError):
            file = tempfile.TemporaryFile(dir=folder)  # noqa: SIM115  closed by `free`
            self.free = weakref.finalize(self, file.close)
            os.posix_fallocate(file.fileno(), 0, size)


def write_with_timeout(path: Path, text: str) -> str | None:
    """Write a file like `write_whole`, but wait at most `DISK_TIMEOUT` for the disk.

    Returns:
        None if the file is on the disk; else the reason why not, in words.
    """
    failure_reason: list[str | None] = [DISK_HANGS]

    def write() -> None:
        try:
            write_whole(path, text)
        except OSError as error:
            failure_reason[0] = reason_of(error)
        else:
            failure_reason[0] = None

    thread = threading.Thread(target=write, name=path.name, daemon=True)
    thread.start()
    thread.join(DISK_TIMEOUT)
    return failure_reason[0]


def write_whole(path: Path, content: str | bytes, mode: int = 0o666) -> None:
    """Write or replace a file; when this returns, its content and its name are on the disk.

    The content goes to a temporary file in the same folder, which then takes the file's name.

    Args:
        path: path of the file; its folder exists.
        content: the complete content; a text is written in UTF-8, with `?` for what UTF-8 cannot
            encode, such as bytes of a file name in another encoding.
        mode: permissions of the file, less the process's umask.

    Raises:
        OSError: the file cannot be written; the error names it. No temporary file is left.
    """
    if not path.name:  # `.` and `/`
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    temporary_path = path.with_name(f".{path.name}.{os.getpid()}")
    data = content.encode("utf-8", "replace") if isinstance(content, str) else content
    try:
        descriptor = os.open(temporary_path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, mode)
        with os.fdopen(descriptor, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        temporary_path.replace(path)
        _sync_folder(path.parent)
    except OSError as error:  # it names the temporary file, or no file
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        with suppress(OSError):  # after a success it no longer exists
            temporary_path.unlink()


def _sync_folder(folder: Path) -> None:
    """Write the folder's entries to the disk, if the file system supports it."""
    with suppress(OSError):  # some network file systems refuse; the file itself is whole
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
