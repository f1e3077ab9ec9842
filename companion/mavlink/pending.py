"""Queues of answers for which tasks wait; when the connection drops, every wait ends at once."""

import asyncio
from typing import Any, Generic, TypeVar

from companion.mavlink.errors import LinkLost

T = TypeVar("T")


class AnswerQueue(Generic[T]):
    """A queue of answers: callbacks of the link fill it, and one task waits for the next answer.

    Use it as a context manager.
    """

    def __init__(self, registry: "AnswerQueueRegistry") -> None:
        self._waiting_queues = registry.waiting_queues
        self._queue: asyncio.Queue[T | LinkLost] = asyncio.Queue()

    def put(self, answer: T | LinkLost) -> None:
        """Add an answer, or the error that ends the wait."""
        self._queue.put_nowait(answer)

    async def next(self, timeout_s: float) -> T:
        """Wait for the next answer.

        Raises:
            TimeoutError: no answer came in time.
            LinkLost: the connection dropped.
        """
        async with asyncio.timeout(timeout_s):
            answer = await self._queue.get()
        if isinstance(answer, LinkLost):
            raise answer
        return answer

    def __enter__(self) -> "AnswerQueue[T]":
        self._waiting_queues[self] = None
        return self

    def __exit__(self, *_: object) -> None:
        del self._waiting_queues[self]


class AnswerQueueRegistry:
    """All queues of a link on which a task waits.

    Attributes:
        waiting_queues: the queues, as keys of a dict, because a dict keeps their order and a set
            does not.
    """

    def __init__(self) -> None:
        self.waiting_queues: dict[AnswerQueue[Any], None] = {}

    def fail(self, reason: str) -> None:
        """End every wait with `LinkLost`, whose message names `reason`."""
        for queue in tuple(self.waiting_queues):
            queue.put(LinkLost(f"the link dropped while waiting for an answer ({reason})"))
