"""A timer with a steady period that can be triggered early."""

import asyncio
from collections.abc import Callable
from contextlib import suppress


class Ticker:
    """Waits until the next period begins, or until `soon` is called.

    Args:
        period: s.
        clock: returns event-loop time, s.
    """

    def __init__(self, period: float, clock: Callable[[], float]) -> None:
        self._period, self._clock = period, clock
        self._due = clock()
        self._soon = asyncio.Event()

    def soon(self) -> None:
        """End the wait of `tick` at once; the next period begins then."""
        self._soon.set()

    async def tick(self) -> None:
        """Wait for the next period, or for `soon`; missed periods are not repeated."""
        self._due = max(self._due + self._period, self._clock())
        with suppress(TimeoutError):
            async with asyncio.timeout(self._due - self._clock()):
                await self._soon.wait()
                self._due = self._clock()
        self._soon.clear()
