"""Lockstep: an event loop whose clock the vehicle advances, step by step.

The vehicle ends each of its steps with a beacon, SYSTEM_TIME(time_boot_ms = t), and waits for the
answer of `companion`. Between beacon and answer, everything that is due runs in vehicle time. The
answer is the last datagram of the step. No result depends on the speed of either side, so a flight
is bit-identical each time, and runs as fast as both can compute.
"""

import asyncio
import os
import time
from collections.abc import Callable, Coroutine
from contextvars import Context
from typing import Any, TypeVar, TypeVarTuple

from companion.mavlink.loop import HotSelector, LinkEventLoop, Ready

T = TypeVar("T")
Arguments = TypeVarTuple("Arguments")

PATIENCE_S = 2.0
"""Wall time without I/O, s, after which the vehicle counts as gone and time advances without it."""

_SPIN_S = 0.0005
"""Wall time of polling for the next beacon before the process sleeps, s."""

_TIMERS_IN_ORDER = 1_000_000
_TIMER_SPACING_S = 1e-12  # a million of them are a microsecond, below any step

_MAX_ITERATIONS = 200
"""The loop counts as settled after this many iterations: a task that never rests must not block."""


class _VehicleClock:
    """Wall time until the first beacon, vehicle time from then on; s."""

    def __init__(self) -> None:
        self._wall_start = time.monotonic()
        self._waiting_since = self._wall_start
        self._vehicle: float | None = None
        self._offset = 0.0  # stays 0 unless the vehicle went away or restarted in between

    def read(self) -> float:
        if self._vehicle is None:
            return time.monotonic() - self._wall_start
        return self._vehicle + self._offset

    def advance(self, vehicle_time: float) -> bool:
        """Set the vehicle time, s; return False for a repeated beacon."""
        if self._vehicle is not None and vehicle_time <= self._vehicle:
            if self._vehicle - vehicle_time < 1.0:
                return False
            # The vehicle restarted. Our time does not go back; its time continues from here.
            self._offset += self._vehicle - vehicle_time
        self._vehicle = vehicle_time
        return True

    def start_waiting(self) -> None:
        """Start the time in which the vehicle must send its next beacon."""
        self._waiting_since = time.monotonic()

    def time_left(self) -> float | None:
        """Wall time left for the next beacon, s; `None` before the first beacon."""
        if self._vehicle is None:
            return None
        return max(0.0, self._waiting_since + PATIENCE_S - time.monotonic())

    def advance_alone(self) -> None:
        """Advance time without the vehicle, which sent no beacon in time: timeouts must end."""
        self._offset += PATIENCE_S
        self.start_waiting()


class _SteppingSelector(HotSelector):
    """Detects when the loop has nothing left to do; no timer waits on the wall clock."""

    def __init__(self, clock: _VehicleClock) -> None:
        super().__init__()
        self._clock = clock
        self._when_idle: Callable[[], None] | None = None
        self._iterations = 0

    def settle(self, then: Callable[[], None]) -> None:
        """Call `then` once no callback or timer of the loop is ready; no I/O happens before."""
        self._when_idle, self._iterations = then, 0

    def select(self, timeout: float | None = None) -> Ready:
        if self._when_idle is not None:
            # The loop polls with timeout 0 exactly when callbacks or timers are ready.
            self._iterations += 1
            if timeout != 0 or self._iterations > _MAX_ITERATIONS:
                then, self._when_idle = self._when_idle, None
                then()
                self._clock.start_waiting()
            return []
        left = None if timeout == 0 else self._clock.time_left()
        if left is None:
            return super().select(timeout)
        ready = self._spin()
        if not ready and self._when_idle is None:
            ready = super().select(left)
        if self._when_idle is None and self._clock.time_left() == 0.0:
            self._clock.advance_alone()
        return ready

    def _spin(self) -> Ready:
        """Poll for the next beacon without sleeping: waking up would take longer."""
        give_up = time.perf_counter() + _SPIN_S
        while time.perf_counter() < give_up:
            ready = super().select(0)
            if ready or self._when_idle is not None:
                return ready
            os.sched_yield()  # let other processes use this core
        return []


class LockstepEventLoop(LinkEventLoop):
    """An event loop in vehicle time: only `advance` changes `time()`.

    Before the first beacon it runs on wall time. If nothing has been received for `PATIENCE_S` of
    wall time, its time advances by that. So the usual timeouts end if the vehicle is gone.
    """

    def __init__(self) -> None:
        self._clock = _VehicleClock()
        self._stepping = _SteppingSelector(self._clock)
        self._scheduled_so_far = 0
        super().__init__(self._stepping)

    def time(self) -> float:
        """Vehicle time in s."""
        return self._clock.read()

    def call_at(
        self,
        when: float,
        callback: Callable[[*Arguments], object],
        *args: *Arguments,
        context: Context | None = None,
    ) -> asyncio.TimerHandle:
        """Schedule a timer; timers due at the same time run in the order of scheduling.

        In asyncio the order of such timers depends on the shape of its heap, and so on timers from
        the time before the first beacon, when wall time counted.
        """
        self._scheduled_so_far += 1
        order = self._scheduled_so_far % _TIMERS_IN_ORDER * _TIMER_SPACING_S
        # A timer later than requested, even by a picosecond, would run a whole step late.
        early = _TIMERS_IN_ORDER * _TIMER_SPACING_S
        return super().call_at(when - early + order, callback, *args, context=context)

    def advance(self, vehicle_time: float) -> bool:
        """Move the clock to a beacon's time, s; return False for a repeated beacon."""
        return self._clock.advance(vehicle_time)

    def settle(self, then: Callable[[], None]) -> None:
        """Run all that is ready and due, without I/O, and then call `then`."""
        self._stepping.settle(then)


def run(main: Coroutine[Any, Any, T]) -> T:
    """Run `main` like `asyncio.run`, in vehicle time."""
    with asyncio.Runner(loop_factory=LockstepEventLoop) as runner:
        return runner.run(main)


class LockstepClient:
    """Handles beacons: runs one step of `companion` for each, and answers.

    Args:
        loop: The event loop to advance.
        process: Handles the frames of one step, in order, after the clock has advanced.
        deliver: Passes the attitude sample of the step, if any, to the control loop.
        answer: Sends the answer that closes the step of `time_boot_ms`.

    Attributes:
        first_beacon: Done when the first beacon has come.
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
        """Vehicle time of the open step, ms; `None` between an answer and the next beacon."""
        return self._step_ms

    def beacon(self, time_boot_ms: int) -> None:
        """Take a beacon: start a step, or answer a repeated beacon again."""
        if self._step_ms is not None:
            return  # a beacon repeated during the step, whose answer will follow
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
