"""An asyncio event loop that runs some readers without the loop's own detour.

Between the kernel saying "readable" and a plain `add_reader` callback, asyncio builds and runs a
handle: some 15 to 20 us at 250 Hz, when the caches are cold. The selector here calls a hot
reader itself, the moment it sees it; everything else of asyncio follows after. (Measured by
`companion bench link`. The stock datagram transport is slower still: it reads every packet into
a fresh 256 KiB buffer.)
"""

import asyncio
import gc
import select
import selectors
from collections.abc import Callable, Coroutine
from math import ceil
from typing import Any, TypeVar

T = TypeVar("T")

Ready = list[tuple[selectors.SelectorKey, int]]


class HotSelector(selectors.DefaultSelector):
    """A selector that serves some file descriptors on the spot.

    It polls the hot descriptors and one nested selector that holds all other descriptors. So
    hot descriptors skip asyncio's bookkeeping.
    """

    def __init__(self) -> None:
        super().__init__()
        self._hot: dict[int, Callable[[], None]] = {}
        self._poll = select.poll()
        self._poll.register(self.fileno(), select.POLLIN)

    def serve(self, fd: int, callback: Callable[[], None]) -> None:
        """Call `callback` as soon as `fd` is readable."""
        self._poll.register(fd, select.POLLIN)
        self._hot[fd] = callback

    def release(self, fd: int) -> None:
        """Serve `fd` no more."""
        self._poll.unregister(fd)
        del self._hot[fd]

    def select(self, timeout: float | None = None) -> Ready:
        """Wait as every selector does; hot descriptors are served before this returns."""
        others = False
        # Rounded up: a timer that is woken early would only poll again.
        for fd, _ in self._poll.poll(None if timeout is None else ceil(timeout * 1e3)):
            callback = self._hot.get(fd)
            if callback is not None:
                callback()
            else:
                others = True
        return super().select(0) if others else []


class LinkEventLoop(asyncio.SelectorEventLoop):
    """A selector loop with hot readers.

    A hot callback runs between two iterations of the loop, where it may do what any callback
    may (send, set futures, `call_soon`). It must not raise and must not block.
    """

    def __init__(self, selector: HotSelector | None = None) -> None:
        self._hot_selector = selector or HotSelector()
        super().__init__(self._hot_selector)

    def add_hot_reader(self, fd: int, callback: Callable[[], None]) -> None:
        """Watch `fd`, and call back the moment it is readable."""
        self._hot_selector.serve(fd, callback)

    def remove_hot_reader(self, fd: int) -> None:
        """Stop watching `fd`."""
        self._hot_selector.release(fd)


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
    """Like `asyncio.run`, on a `LinkEventLoop`.

    What exists by now, modules above all, lives as long as the program: the garbage collector is
    told not to walk through it again, which it would do in the middle of a control step.
    """
    gc.collect()
    gc.freeze()
    try:
        with asyncio.Runner(loop_factory=LinkEventLoop) as runner:
            return runner.run(main)
    finally:
        gc.unfreeze()
