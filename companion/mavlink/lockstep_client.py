"""Our half of the strict alternation with a vehicle in lockstep."""

import asyncio
from collections.abc import Callable

from companion.mavlink.lockstep import LockstepEventLoop


class LockstepClient:
    """Our half of the strict alternation.

    Args:
        loop: The loop to drive.
        process: Handles one step's frames, in order, after the clock was moved.
        deliver: Hands the step's attitude sample, if any, to the control loop.
        answer: Sends what closes the step `time_boot_ms`.
    """

    def __init__(
        self,
        loop: LockstepEventLoop,
        process: Callable[[], None],
        deliver: Callable[[], None],
        answer: Callable[[int], None],
    ) -> None:
        self._loop = loop
        self._process, self._deliver, self._answer = process, deliver, answer
        self._step_ms: int | None = None
        self._closed = False
        self.first_beacon: asyncio.Future[None] = loop.create_future()

    @property
    def step_ms(self) -> int | None:
        """Vehicle time in ms of the step that is open, `None` while the vehicle has its turn."""
        return self._step_ms

    def beacon(self, time_boot_ms: int) -> None:
        """Take a beacon: start the step, or answer again if that answer got lost."""
        if self._step_ms is not None:
            return  # repeated while we are still at it; the answer is on its way
        if not self._loop.advance(time_boot_ms / 1000.0):
            self._answer(time_boot_ms)
            return
        self._step_ms = time_boot_ms
        if not self.first_beacon.done():
            self.first_beacon.set_result(None)
        self._process()
        self._loop.settle(self._after_tasks)

    def close(self) -> None:
        """Stop: the open step gets no sample and no answer."""
        self._closed = True

    def _after_tasks(self) -> None:
        if self._closed:
            return
        self._deliver()
        # Settle again, so that tasks started by the control loop send before the step closes.
        self._loop.settle(self._close)

    def _close(self) -> None:
        step, self._step_ms = self._step_ms, None
        if step is not None and not self._closed:
            self._answer(step)
