"""A file written by its own thread, so that the caller never waits for the disk.

The thread checks every 50 ms for new items, because waking it for each item would cost the control
loop more than the rest of the recording. The thread writes the items in slices, and pauses after
each slice, so that the control loop can run. Twice a second it waits until the written data are on
the disk.
"""

import threading
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Sequence
from math import inf
from pathlib import Path
from time import monotonic, sleep
from typing import Generic, Self, TypeVar

from companion.files.write_whole import DISK_HANGS, DISK_TIMEOUT, reason_of

T = TypeVar("T")

_CHECK_PERIOD = 0.05
"""Time between two checks for new items, s."""
_MIN_SLICE_LENGTH = 20
"""Smallest number of items in a slice, unless fewer are waiting."""
_MAX_SLICES = 50
"""Largest number of slices in which a backlog is written."""
_SLICE_PAUSE = 0.001
"""Pause after a slice, s."""
_SYNC_PERIOD = 0.5
"""Time between two syncs to the disk, s. A power cut loses what was written since the last one."""


class BackgroundFile(ABC, Generic[T]):
    """Writes items to a file in its own thread; it never delays or ends a flight.

    Items that `put` takes before `open` are written once the file is open. A subclass defines the
    format of the file; only the thread calls the subclass's `_write`, `_sync` and `_finish_file`.

    Attributes:
        path: path of the file.
        dropped: number of items that were not written, because too many waited, writing had failed,
            or (`FlightRecorder`) an item could not be encoded.
        failure: why writing stopped, for example a full disk; None: no failure.

    Args:
        path: path of the file.
        max_waiting: largest number of waiting items; further ones are dropped.
        on_failure: called once, with `failure`, when the file cannot be written any more: from the
            writing thread, or from `close` if the disk does not answer.
    """

    def __init__(
        self, path: Path, max_waiting: int, on_failure: Callable[[str], None] | None = None
    ) -> None:
        self.path = path
        self.dropped = 0
        self.failure: str | None = None
        self._on_failure = on_failure
        self._max_waiting = max_waiting
        self._waiting_items: deque[T] = deque()
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None
        self._synced_at = -inf  # so that the first items are synced at once

    @abstractmethod
    def _create(self) -> None:
        """Create the file. Raises OSError if that is impossible."""

    @abstractmethod
    def _write(self, items: Sequence[T]) -> None:
        """Write items. Raises OSError if the disk is full or has failed."""

    @abstractmethod
    def _sync(self) -> None:
        """Wait until all items are on the disk. Raises OSError like `_write`."""

    @abstractmethod
    def _finish_file(self, *, complete: bool) -> None:
        """Close the file; if `complete`, first write its end, such as an index. Raises OSError."""

    def open(self) -> None:
        """Create the file, and begin to write.

        Raises:
            OSError: the file cannot be created.
        """
        self._create()
        self._thread = threading.Thread(
            target=self._write_until_closed, name=self.path.name, daemon=True
        )
        self._thread.start()

    @property
    def waiting(self) -> int:
        """Number of items that wait to be written."""
        return len(self._waiting_items)

    def put(self, item: T) -> None:
        """Take one item, or drop it if too many wait."""
        if len(self._waiting_items) < self._max_waiting:
            self._waiting_items.append(item)
        else:
            self.dropped += 1

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Write the waiting items and close the file.

        If the disk does not answer for 5 s, this counts as a failure, and the thread is abandoned.
        """
        self._closing.set()
        if self._thread is not None:
            self._thread.join(DISK_TIMEOUT)
            if self._thread.is_alive():
                self.dropped += len(self._waiting_items)
                self._note_failure(DISK_HANGS)

    def _write_until_closed(self) -> None:
        while not self._closing.wait(_CHECK_PERIOD):
            self._write_waiting_items()
            self._sync_when_due()
        self._write_waiting_items()
        self._catch_failure(lambda: self._finish_file(complete=self.failure is None))

    def _write_waiting_items(self) -> None:
        """Write the items that are waiting now; items that arrive later wait for the next call."""
        remaining = len(self._waiting_items)
        size = max(_MIN_SLICE_LENGTH, -(-remaining // _MAX_SLICES))
        while remaining > 0:
            items = [self._waiting_items.popleft() for _ in range(min(size, remaining))]
            remaining -= len(items)
            self._write_slice(items)
            self._sync_when_due()
            if not self._closing.is_set():
                sleep(_SLICE_PAUSE)

    def _write_slice(self, items: Sequence[T]) -> None:
        if self.failure is None:
            self._catch_failure(lambda: self._write(items))
        if self.failure is not None:
            self.dropped += len(items)

    def _sync_when_due(self) -> None:
        if self.failure is None and monotonic() - self._synced_at >= _SYNC_PERIOD:
            self._catch_failure(self._sync)
            self._synced_at = monotonic()

    def _catch_failure(self, file_operation: Callable[[], None]) -> None:
        try:
            file_operation()
        except OSError as error:
            self._note_failure(reason_of(error))
        except Exception as error:  # an item that cannot be written must not end the flight
            self._note_failure(f"internal error: {error!r}")

    def _note_failure(self, reason: str) -> None:
        if self.failure is None:
            self.failure = f"{self.path}: recording stopped: {reason}; the flight goes on"
            if self._on_failure is not None:
                self._on_failure(self.failure)
