"""A timer with a steady period that can be triggered early."""

import asyncio
from collections.abc import Callable


class Ticker:
    """Waits until the next period begins, or until `trigger` is called.

    Args:
        period: period, s.
        clock: returns event-loop time, s.
    """

    def __init__(self, period: float, clock: Callable[[], float]) -> None:
        self._period, self._clock = period, clock
        self._due = clock()
        self._soon = False
        self._waiting: asyncio.Future[None] | None = None

    def trigger(self) -> None:
        """End the wait of `tick` at once, and begin the next period then."""
        self._soon = True
        if self._waiting is not None:
            _wake(self._waiting)

    async def tick(self) -> None:
        """Wait for the next period or for `trigger`; missed periods are not repeated."""
        self._due = max(self._due + self._period, self._clock())
        if not self._soon:
            await self._sleep(self._due - self._clock())
        if self._soon:
            self._soon, self._due = False, self._clock()

    async def _sleep(self, seconds: float) -> None:
        loop = asyncio.get_running_loop()
        self._waiting = loop.create_future()
        timer = loop.call_later(seconds, _wake, self._waiting)
        try:
            await self._waiting
        finally:
            timer.cancel()


def _wake(waiting: asyncio.Future[None]) -> None:
    if not waiting.done():
        waiting.set_result(None)
