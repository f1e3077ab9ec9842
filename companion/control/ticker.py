"""A timer with a steady period that can be told to tick at once."""

import asyncio
from collections.abc import Callable
from contextlib import suppress


class Ticker:
    """Waits until the next period begins, or until `soon` is called.

    Args:
        period: s.
        clock: ours, s.
    """

    def __init__(self, period: float, clock: Callable[[], float]) -> None:
        self._period, self._clock = period, clock
        self._due = clock()
        self._soon = asyncio.Event()

    def soon(self) -> None:
        """Tick at once; the next period begins then."""
        self._soon.set()

    async def tick(self) -> None:
        """Wait; missed periods are not made up for."""
        self._due = max(self._due + self._period, self._clock())
        with suppress(TimeoutError):
            async with asyncio.timeout(self._due - self._clock()):
                await self._soon.wait()
                self._due = self._clock()
        self._soon.clear()
