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
        self._next_start = clock()
        self._triggered = False
        self._waiting: asyncio.Future[None] | None = None

    def trigger(self) -> None:
        """End the wait of `tick` at once, and begin the next period then."""
        self._triggered = True
        if self._waiting is not None:
            _wake(self._waiting)

    async def tick(self) -> None:
        """Wait for the next period or for `trigger`; missed periods are skipped."""
        self._next_start = max(self._next_start + self._period, self._clock())
        if not self._triggered:
            await self._sleep(self._next_start - self._clock())
        if self._triggered:
            self._triggered, self._next_start = False, self._clock()

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
