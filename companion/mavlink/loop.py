"""An asyncio event loop that runs one reader without the loop's own detour.

Between the kernel saying "readable" and a plain `add_reader` callback, asyncio builds and runs a
handle: some 15 to 20 us at 250 Hz, when the caches are cold. The selector here calls the one hot
reader itself, the moment it sees it; everything else of asyncio follows after. (Measured by
`companion bench link`. The stock datagram transport is slower still: it reads every packet into
a fresh 256 KiB buffer.)
"""

import asyncio
import selectors
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

T = TypeVar("T")

Ready = list[tuple[selectors.SelectorKey, int]]


class HotSelector(selectors.DefaultSelector):
    """A selector that serves one file descriptor on the spot."""

    def __init__(self) -> None:
        super().__init__()
        self._hot_fd = -1
        self._hot: Callable[[], None] | None = None

    def serve(self, fd: int, callback: Callable[[], None] | None) -> None:
        """Call `callback` as soon as `fd` is readable; `None` ends it."""
        self._hot_fd, self._hot = (fd, callback) if callback else (-1, None)

    def select(self, timeout: float | None = None) -> Ready:
        """Wait as every selector does; the hot descriptor is served before this returns."""
        ready: Ready = super().select(timeout)
        for index, (key, events) in enumerate(ready):
            if key.fd == self._hot_fd and events & selectors.EVENT_READ and self._hot is not None:
                rest = events & ~selectors.EVENT_READ
                ready[index : index + 1] = [(key, rest)] if rest else []
                self._hot()
                break
        return ready


class LinkEventLoop(asyncio.SelectorEventLoop):
    """A selector loop with one hot reader.

    The hot callback runs between two iterations of the loop, where it may do what any callback
    may (send, set futures, `call_soon`). It must not raise and must not block.
    """

    def __init__(self, selector: HotSelector | None = None) -> None:
        self._hot_selector = selector or HotSelector()
        super().__init__(self._hot_selector)

    def add_hot_reader(self, fd: int, callback: Callable[[], None]) -> None:
        """Watch `fd`; there is one hot reader, and the newest replaces an older one."""
        self.add_reader(fd, callback)
        self._hot_selector.serve(fd, callback)

    def remove_hot_reader(self, fd: int) -> None:
        """Stop watching `fd`."""
        self._hot_selector.serve(fd, None)
        self.remove_reader(fd)


def watch(loop: asyncio.AbstractEventLoop, fd: int, callback: Callable[[], None]) -> None:
    """Watch `fd` the fastest way this loop knows."""
    if isinstance(loop, LinkEventLoop):
        loop.add_hot_reader(fd, callback)
    else:
        loop.add_reader(fd, callback)


def unwatch(loop: asyncio.AbstractEventLoop, fd: int) -> None:
    """Undo `watch`."""
    if isinstance(loop, LinkEventLoop):
        loop.remove_hot_reader(fd)
    else:
        loop.remove_reader(fd)


def run(main: Coroutine[Any, Any, T]) -> T:
    """Like `asyncio.run`, on a `LinkEventLoop`."""
    with asyncio.Runner(loop_factory=LinkEventLoop) as runner:
        return runner.run(main)
