"""An asyncio event loop that calls the readers of the link with less delay.

When a socket is readable, asyncio first builds and runs a handle for its `add_reader` callback.
The handle takes 15 to 20 us, because the caches are cold at 250 Hz. The selector here calls a "hot"
reader directly, before asyncio handles anything else. asyncio's own datagram transport is slower
still: it reads every packet into a new 256 KiB buffer. `companion bench link` measures the delays.
"""

import asyncio
import select
import selectors
from collections.abc import Callable, Coroutine
from contextlib import closing
from math import ceil
from typing import Any, TypeVar

from companion.realtime import frozen_objects

T = TypeVar("T")

ReadyKeys = list[tuple[selectors.SelectorKey, int]]
"""Key and event mask of each file that is ready, as `select` of every selector returns them."""


class HotSelector(selectors.DefaultSelector):
    """A selector that calls the readers of some ("hot") file descriptors itself.

    It polls the hot descriptors, and one nested selector that holds all others. So hot descriptors
    skip asyncio's bookkeeping.
    """

    def __init__(self) -> None:
        super().__init__()
        self._hot_callbacks: dict[int, Callable[[], None]] = {}
        self._poll = select.poll()
        self._poll.register(self.fileno(), select.POLLIN)

    def add_hot_reader(self, fd: int, callback: Callable[[], None]) -> None:
        """Call `callback` as soon as `fd` is readable."""
        self._poll.register(fd, select.POLLIN)
        self._hot_callbacks[fd] = callback

    def remove_hot_reader(self, fd: int) -> None:
        """Stop serving `fd`."""
        self._poll.unregister(fd)
        del self._hot_callbacks[fd]

    def select(self, timeout: float | None = None) -> ReadyKeys:
        """Wait for I/O; hot readers are called before `select` returns."""
        is_other_ready = False
        # Rounded up: a timer that is woken early would only poll again.
        for fd, _ in self._poll.poll(None if timeout is None else ceil(timeout * 1e3)):
            callback = self._hot_callbacks.get(fd)
            if callback is not None:
                callback()
            else:
                is_other_ready = True
        return super().select(0) if is_other_ready else []


class LinkEventLoop(asyncio.SelectorEventLoop):
    """A selector event loop with hot readers, which `HotSelector` calls.

    A hot callback runs between two iterations of the loop. Like any callback it may send, set
    futures or use `call_soon`. It must not raise and must not block.

    Attributes:
        hot_selector: calls the hot readers.
    """

    def __init__(self, selector: HotSelector | None = None) -> None:
        self.hot_selector = selector or HotSelector()
        super().__init__(self.hot_selector)


def watch(loop: asyncio.AbstractEventLoop, fd: int, callback: Callable[[], None]) -> None:
    """Call `callback` when `fd` is readable, in the fastest way that the loop has."""
    if isinstance(loop, LinkEventLoop):
        loop.hot_selector.add_hot_reader(fd, callback)
    else:
        loop.add_reader(fd, callback)


def unwatch(loop: asyncio.AbstractEventLoop, fd: int) -> None:
    """Undo `watch`."""
    if isinstance(loop, LinkEventLoop):
        loop.hot_selector.remove_hot_reader(fd)
    else:
        loop.remove_reader(fd)


def run(main: Coroutine[Any, Any, T]) -> T:
    """Run `main` like `asyncio.run`, on a `LinkEventLoop`.

    The objects that exist now are frozen, so that the garbage collector does not walk through them
    in the middle of a control step.
    """
    with (
        closing(main),  # Ctrl-C before it begins would leave a warning that nobody awaited it
        frozen_objects(),
        asyncio.Runner(loop_factory=LinkEventLoop) as runner,
    ):
        return runner.run(main)
