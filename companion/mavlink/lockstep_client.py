"""The program's side of lockstep: handles the vehicle's beacons."""

import asyncio
from collections.abc import Callable

from companion.mavlink.lockstep import LockstepEventLoop


class LockstepClient:
    """Handles beacons: runs one step of this program for each, and answers.

    Args:
        loop: the event loop to advance.
        process: handles the frames of one step, in order, after the clock has advanced.
        deliver: passes the attitude samples of the step, if any, to the control loop.
        answer: sends the answer that closes the step of `time_boot_ms`.

    Attributes:
        first_beacon: a future that is done when the first beacon has come.
        open_step_time_ms: vehicle time of the open step, ms; `None` while no step is open.
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
        self.open_step_time_ms: int | None = None
        self._closed = False
        self.first_beacon: asyncio.Future[None] = loop.create_future()

    def take_beacon(self, time_boot_ms: int) -> None:
        """Take a beacon: start a step, or answer a repeated beacon again."""
        if self.open_step_time_ms is not None:
            return  # a beacon repeated during the step; the answer to the step will follow
        if not self._loop.advance(time_boot_ms / 1000.0):
            self._answer(time_boot_ms)
            return
        self.open_step_time_ms = time_boot_ms
        if not self.first_beacon.done():
            self.first_beacon.set_result(None)
        self._process()
        self._loop.settle(self._deliver_samples)

    def close(self) -> None:
        """Stop: the open step is not answered, and its samples are not delivered any more."""
        self._closed = True

    def _deliver_samples(self) -> None:
        if self._closed:
            return
        self._deliver()
        # Settle again, so that tasks started by the control loop send before the step closes.
        self._loop.settle(self._close_step)

    def _close_step(self) -> None:
        step, self.open_step_time_ms = self.open_step_time_ms, None
        if step is not None and not self._closed:
            self._answer(step)
