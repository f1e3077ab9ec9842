"""A file that a thread of its own writes: who hands items over never waits for the disk.

The thread looks every 50 ms for new items: to wake it for each of them would cost the control loop
more than all the rest of recording. It writes them in slices, with a pause after each, in which the
control loop can run. Twice a second it waits until the disk has what was written.
"""

import threading
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Sequence
from math import inf
from pathlib import Path
from time import monotonic, sleep
from types import TracebackType
from typing import Generic, Protocol, Self, TypeVar

T = TypeVar("T")
Item_contra = TypeVar("Item_contra", contravariant=True)

_PERIOD = 0.05
_SLICE = 20
"""Items of a slice, if few wait."""
_MOST_SLICES = 50
"""A backlog is written in at most this many slices, however long it is."""
_PAUSE = 0.001
"""Pause after a slice, s."""
_LONGEST_CLOSE = 5.0
"""Time allowed to write out what waits when the file is closed, s."""
_SYNC_PERIOD = 0.5
"""After a power cut this much is missing, s, and the time that the disk takes."""


class ItemFile(Protocol[Item_contra]):
    """A file of one format, used by one thread."""

    def write(self, items: Sequence[Item_contra]) -> None:
        """Write items. Raises OSError: the disk is full, or failed."""
        ...

    def sync(self) -> None:
        """Wait until the disk has all items. Raises OSError: as `write`."""
        ...

    def close(self, *, complete: bool) -> None:
        """Close the file, and complete it first, if it could be written. Raises OSError."""
        ...


class BackgroundFile(ABC, Generic[T]):
    """Hands items to a file in a thread of its own; never delays, never raises in a flight.

    Items are taken from the beginning, and written once the file is open.

    Attributes:
        path: where the file is.
        dropped: items that were not written because too many waited, or the disk was full.
        failure: why writing ended early (a full disk, say), or None.

    Args:
        path: see above.
        most_waiting: further items are dropped.
        on_failure: called once, from the writing thread, when the file cannot be written any more.
    """

    def __init__(
        self,
        path: Path,
        most_waiting: int,
        on_failure: Callable[[str], None] | None = None,
    ) -> None:
        self.path = path
        self.dropped = 0
        self.failure: str | None = None
        self._on_failure = on_failure
        self._most_waiting = most_waiting
        self._waiting: deque[T] = deque()
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None
        self._synced_at = -inf  # the first items are on the disk at once

    @abstractmethod
    def _make_file(self) -> ItemFile[T]:
        """Create the file. Raises OSError: it cannot be created."""

    def open(self) -> None:
        """Create the file, and begin to write.

        Raises:
            OSError: the file cannot be created.
        """
        file = self._make_file()
        self._thread = threading.Thread(
            target=self._run, args=(file,), name=self.path.name, daemon=True
        )
        self._thread.start()

    @property
    def waiting(self) -> int:
        """Number of items that wait to be written."""
        return len(self._waiting)

    def put(self, item: T) -> None:
        """Take one item."""
        if len(self._waiting) < self._most_waiting:
            self._waiting.append(item)
        else:
            self.dropped += 1

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Write out what waits and close the file.

        If the disk does not answer for 5 s, that is a failure: the thread is left behind.
        """
        self._closing.set()
        if self._thread is not None:
            self._thread.join(_LONGEST_CLOSE)
            if self._thread.is_alive():
                self.dropped += len(self._waiting)
                self._fail(f"the disk did not answer for {_LONGEST_CLOSE:g} s")

    def _run(self, file: ItemFile[T]) -> None:
        while not self._closing.wait(_PERIOD):
            self._write_waiting(file)
            self._sync_when_due(file)
        self._write_waiting(file)
        self._guarded(lambda: file.close(complete=self.failure is None))

    def _write_waiting(self, file: ItemFile[T]) -> None:
        """Write what waits now; what comes meanwhile waits for the next time."""
        left = len(self._waiting)
        size = max(_SLICE, -(-left // _MOST_SLICES))
        while left > 0:
            items = [self._waiting.popleft() for _ in range(min(size, left))]
            left -= len(items)
            self._write_slice(file, items)
            self._sync_when_due(file)
            if not self._closing.is_set():
                sleep(_PAUSE)

    def _write_slice(self, file: ItemFile[T], items: Sequence[T]) -> None:
        if self.failure is None:
            self._guarded(lambda: file.write(items))
        if self.failure is not None:
            self.dropped += len(items)

    def _sync_when_due(self, file: ItemFile[T]) -> None:
        if self.failure is None and monotonic() - self._synced_at >= _SYNC_PERIOD:
            self._guarded(file.sync)
            self._synced_at = monotonic()

    def _guarded(self, work: Callable[[], None]) -> None:
        try:
            work()
        except OSError as error:
            self._fail(error.strerror or str(error))
        except Exception as error:  # an item that cannot be written must not end the flight
            self._fail(f"internal error: {error!r}")

    def _fail(self, reason: str) -> None:
        if self.failure is None:
            self.failure = f"{self.path}: recording stopped: {reason}; the flight goes on"
            if self._on_failure is not None:
                self._on_failure(self.failure)
