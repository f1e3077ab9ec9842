"""Rows of numbers recorded in flight: the newest ones in memory, all full chunks on the disk.

Memory does not grow with the flight. A separate thread writes the files in large chunks; the
control loop only passes full chunks, and never waits for the disk. A flight without a folder has no
thread, and its rows stay in memory.
"""

import errno
import os
import tempfile
import threading
import weakref
from array import array
from collections import deque
from pathlib import Path
from queue import SimpleQueue
from typing import IO

import numpy as np
from numpy.typing import NDArray

from companion.files.write_whole import DISK_HANGS, DISK_TIMEOUT, reason_of

_CHUNK_ROWS = 1024
"""Number of rows that are written at a time."""
_MAX_WAITING_CHUNKS = 64
"""Largest number of chunks that wait for a slow disk; further ones are lost and counted."""


class SpooledFile:
    """Temporary file of doubles in `folder`; created by the first `append`, deleted when freed."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._file: IO[bytes] | None = None

    def append(self, chunk: bytes) -> None:
        """Append a chunk.

        Raises:
            OSError: the chunk could not be written completely.
        """
        if self._file is None:
            self._file = tempfile.TemporaryFile(dir=self._folder, buffering=0)  # noqa: SIM115
            weakref.finalize(self, self._file.close)
        if self._file.write(chunk) != len(chunk):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def read(self, width: int) -> NDArray[np.float64]:
        """(N · width,), the doubles of all rows in order; an incomplete last row is left out."""
        if self._file is None:
            return np.empty(0)
        self._file.seek(0)
        data = self._file.read()
        return np.frombuffer(data, count=len(data) // (8 * width) * width)


_SpoolItem = tuple[SpooledFile, bytes] | threading.Event | None


class Spool:
    """Writes chunks to their files, in a thread that starts with the first chunk."""

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = folder
        self._queue: SimpleQueue[_SpoolItem] = SimpleQueue()
        self._failures: list[str] = []
        self._has_started = self._disk_hangs = False

    @property
    def failure(self) -> str | None:
        """Why a chunk could not be written; nothing is written after that. None: no failure."""
        return self._failures[0] if self._failures else None

    def put(self, file: SpooledFile, chunk: bytes) -> bool:
        """Take a chunk; return false if it cannot be kept."""
        if self._failures or self._queue.qsize() >= _MAX_WAITING_CHUNKS:
            return False
        if not self._has_started:
            self._has_started = True
            own = self._queue, self._failures  # not self, which the thread would keep alive
            threading.Thread(target=_append_chunks, args=own, name="spool", daemon=True).start()
            weakref.finalize(self, self._queue.put, None)
        self._queue.put((file, chunk))
        return True

    def flush(self) -> bool:
        """Wait until all chunks are written; return false if the disk does not answer for 5 s."""
        if self._has_started and not self._disk_hangs:
            all_written = threading.Event()
            self._queue.put(all_written)
            if not all_written.wait(DISK_TIMEOUT):
                self._disk_hangs = True
                self._failures.append(DISK_HANGS)
        return not self._disk_hangs


def _append_chunks(queue: "SimpleQueue[_SpoolItem]", failures: list[str]) -> None:
    while (item := queue.get()) is not None:
        if isinstance(item, threading.Event):
            item.set()
        elif not failures:
            file, chunk = item
            try:
                file.append(chunk)
            except OSError as error:
                failures.append(reason_of(error))


class Series:
    """Rows of one kind, appended in flight.

    Args:
        spool: writes the rows that are not kept in memory.
        rows_in_memory: number of newest rows that are always in memory.

    Attributes:
        columns: names of the columns.
        lost_count: rows that were lost because the disk was full or too slow.
    """

    def __init__(self, columns: tuple[str, ...], spool: Spool, rows_in_memory: int = 0) -> None:
        self.columns = columns
        self.lost_count = 0
        self._spool = spool
        # Without a folder all rows stay in memory.
        self._file = None if spool.folder is None else SpooledFile(spool.folder)
        self._chunk_length = _CHUNK_ROWS * len(columns)
        self._chunk = array("d")
        max_chunks = None if self._file is None else -(-rows_in_memory // _CHUNK_ROWS)
        self._recent_chunks: deque[array[float]] = deque(maxlen=max_chunks)
        self._spooled_row_count = 0

    def __len__(self) -> int:
        """Number of rows recorded so far."""
        return self._spooled_row_count + len(self._chunk) // len(self.columns)

    def add(self, row: list[float]) -> None:
        """Record one row; its length is not checked."""
        self._chunk.fromlist(row)  # takes half as long as `extend`
        if len(self._chunk) == self._chunk_length:
            self._spool_chunk()

    def extend(self, rows: NDArray[np.float64]) -> None:
        """Record rows (N, columns)."""
        for row in rows.tolist():
            self.add(row)

    def rows(self, since: int = 0) -> NDArray[np.float64]:
        """(N, columns), the rows from number `since` on; lost rows are left out.

        In flight, request only rows that are still in memory; for older rows this call waits for
        the disk.
        """
        wanted_count = max(0, len(self) - since) * len(self.columns)
        chunks: list[array[float]] = [self._chunk]
        count_in_memory = len(self._chunk)
        for chunk in reversed(self._recent_chunks):
            if count_in_memory >= wanted_count:
                break
            chunks.insert(0, chunk)
            count_in_memory += len(chunk)
        if self._file is not None and count_in_memory < wanted_count and self._spool.flush():
            values = np.concatenate([self._file.read(len(self.columns)), self._chunk])
        else:  # in memory, or all that there is while the disk does not answer
            missing_count = (wanted_count - count_in_memory) // len(self.columns)
            self.lost_count = max(self.lost_count, missing_count)
            values = np.concatenate(chunks)
        return values[max(0, len(values) - wanted_count) :].reshape(-1, len(self.columns))

    def _spool_chunk(self) -> None:
        chunk, self._chunk = self._chunk, array("d")
        self._spooled_row_count += _CHUNK_ROWS
        self._recent_chunks.append(chunk)
        if self._file is not None and not self._spool.put(self._file, chunk.tobytes()):
            self.lost_count += _CHUNK_ROWS
