"""Queues of answers for which tasks wait; when the connection drops, every wait ends at once."""

import asyncio
from typing import Generic, TypeVar

from companion.mavlink.errors import LinkLost

T = TypeVar("T")


class AnswerQueue(Generic[T]):
    """A queue of answers: callbacks of the link fill it, and one task waits for it.

    Use as a context manager.
    """

    def __init__(self, registry: "AnswerQueueRegistry") -> None:
        self._registry = registry
        self._queue: asyncio.Queue[T | LinkLost] = asyncio.Queue()

    def put(self, answer: T) -> None:
        """Add an answer."""
        self._queue.put_nowait(answer)

    def fail(self, error: LinkLost) -> None:
        """End the wait: `next` raises `error`."""
        self._queue.put_nowait(error)

    async def next(self, timeout_s: float) -> T:
        """Wait for the next answer.

        Raises:
            TimeoutError: No answer came in time.
            LinkLost: The connection dropped.
        """
        async with asyncio.timeout(timeout_s):
            answer = await self._queue.get()
        if isinstance(answer, LinkLost):
            raise answer
        return answer

    def __enter__(self) -> "AnswerQueue[T]":
        self._registry.add(self)
        return self

    def __exit__(self, *_: object) -> None:
        self._registry.discard(self)


class AnswerQueueRegistry:
    """All queues of a link on which a task waits."""

    def __init__(self) -> None:
        # A dict has a fixed order, which keeps flights repeatable; a set has none.
        self._waiting: dict[int, AnswerQueue[object]] = {}

    def add(self, pending: AnswerQueue[T]) -> None:
        """Add a queue."""
        self._waiting[id(pending)] = pending  # type: ignore[assignment]

    def discard(self, pending: AnswerQueue[T]) -> None:
        """Remove a queue."""
        self._waiting.pop(id(pending), None)

    def fail(self, reason: str) -> None:
        """End every wait with `LinkLost`, whose message names `reason`."""
        for pending in tuple(self._waiting.values()):
            pending.fail(LinkLost(f"the link dropped while waiting for an answer ({reason})"))
