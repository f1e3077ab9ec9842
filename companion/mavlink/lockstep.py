"""Lockstep: an event loop whose clock the vehicle advances, step by step.

The vehicle ends each of its steps with a beacon, SYSTEM_TIME(time_boot_ms = t), and waits for the
answer of `companion`. Between beacon and answer, everything that is due runs in vehicle time. The
answer is the last datagram of the step. No result depends on the speed of the two programs, so a
flight is bit-identical each time, and runs as fast as both programs can compute.
"""

import asyncio
import os
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Coroutine
from contextlib import closing
from contextvars import Context
from functools import partial
from typing import Any, Protocol, TypeVar, TypeVarTuple

from companion.mavlink.loop import HotSelector, LinkEventLoop, ReadyKeys

T = TypeVar("T")
Arguments = TypeVarTuple("Arguments")

BEACON_TIMEOUT_S = 2.0
"""Wall time without a new beacon after which the vehicle counts as gone, s; then the event loop's
time advances without beacons.
"""

_BUSY_WAIT_S = 0.0005
"""Wall time of polling for the next beacon before the process sleeps, s."""

_TIMERS_IN_ORDER = 1_000_000
"""Number of consecutive timers whose order is kept if they are due at the same time."""
_TIMER_SPACING_S = 1e-12
"""Shift between two timers that are due at the same time, s. `_TIMERS_IN_ORDER` shifts are 1 us,
shorter than any step.
"""

_MAX_ITERATIONS = 200
"""The loop counts as settled after this many iterations, so that a busy task cannot block it."""


class LockstepClock(Protocol):
    """The clock of an event loop that the vehicle advances."""

    def read(self) -> float:
        """Event-loop time, s."""

    def advance(self, vehicle_time: float) -> bool:
        """Set the time to that of a beacon, s; return False if the beacon is not newer."""


class _BeaconClock:
    """Wall time in s until the first beacon, vehicle time in s from then on.

    If no new beacon comes for `BEACON_TIMEOUT_S` of wall time, its time advances by that amount, so
    that timeouts expire if the vehicle is gone.
    """

    def __init__(self) -> None:
        self._wall_start = time.monotonic()
        self._waiting_since = self._wall_start
        self._vehicle_time: float | None = None
        self._offset = 0.0  # added to vehicle time, s; 0 until the vehicle is silent or restarts

    def read(self) -> float:
        if self._vehicle_time is None:
            return time.monotonic() - self._wall_start
        return self._vehicle_time + self._offset

    def advance(self, vehicle_time: float) -> bool:
        """Set the time to that of a beacon, s; return False if the beacon is not newer."""
        if self._vehicle_time is not None and vehicle_time <= self._vehicle_time:
            if self._vehicle_time - vehicle_time < 1.0:
                return False
            # The vehicle restarted. Our time must not go back, so it continues from here.
            self._offset += self._vehicle_time - vehicle_time
        self._vehicle_time = vehicle_time
        return True

    def start_waiting(self) -> None:
        """Start the timeout for the vehicle's next beacon."""
        self._waiting_since = time.monotonic()

    def beacon_time_left(self) -> float | None:
        """Wall time left for the next beacon, s; `None` before the first beacon."""
        if self._vehicle_time is None:
            return None
        return max(0.0, self._waiting_since + BEACON_TIMEOUT_S - time.monotonic())

    def advance_without_beacon(self) -> None:
        """Advance time although the vehicle sent no beacon in time."""
        self._offset += BEACON_TIMEOUT_S
        self.start_waiting()


class SettlingSelector(HotSelector, ABC):
    """Detects when the loop has nothing left to do in a lockstep step."""

    def __init__(self) -> None:
        super().__init__()
        self._on_settled: Callable[[], None] | None = None
        self._iterations = 0

    def settle(self, callback: Callable[[], None]) -> None:
        """Call `callback` once nothing else in the loop is ready or due; do no I/O until then."""
        self._on_settled, self._iterations = callback, 0

    @property
    def is_settling(self) -> bool:
        """Whether a step is open: ready callbacks and due timers run, and no I/O happens."""
        return self._on_settled is not None

    def select(self, timeout: float | None = None) -> ReadyKeys:
        """Settle an open step; otherwise wait for the vehicle."""
        if self._on_settled is None:
            return self.wait(timeout)
        # The loop polls with timeout 0 exactly when callbacks or timers are ready.
        self._iterations += 1
        if timeout != 0 or self._iterations > _MAX_ITERATIONS:
            callback, self._on_settled = self._on_settled, None
            callback()
        return []

    @abstractmethod
    def wait(self, timeout: float | None) -> ReadyKeys:
        """Wait for I/O, as `select` of every selector does."""


class _SteppingSelector(SettlingSelector):
    """Waits for the vehicle's beacons, not for timers: only a beacon makes a timer due."""

    def __init__(self, clock: _BeaconClock) -> None:
        super().__init__()
        self._clock = clock

    def select(self, timeout: float | None = None) -> ReadyKeys:
        was_settling = self.is_settling
        ready = super().select(timeout)
        if was_settling and not self.is_settling:
            self._clock.start_waiting()
        return ready

    def wait(self, timeout: float | None) -> ReadyKeys:
        beacon_time_left = None if timeout == 0 else self._clock.beacon_time_left()
        if beacon_time_left is None:
            return HotSelector.select(self, timeout)
        ready = self._busy_wait()
        if not ready and not self.is_settling:
            ready = HotSelector.select(self, beacon_time_left)
        if not self.is_settling and self._clock.beacon_time_left() == 0.0:
            self._clock.advance_without_beacon()
        return ready

    def _busy_wait(self) -> ReadyKeys:
        """Poll for the next beacon without sleeping: waking up would take longer."""
        deadline = time.perf_counter() + _BUSY_WAIT_S
        while time.perf_counter() < deadline:
            ready = HotSelector.select(self, 0)
            if ready or self.is_settling:
                return ready
            os.sched_yield()  # let other processes use this core
        return []


class LockstepEventLoop(LinkEventLoop):
    """An event loop in vehicle time: `advance` sets `time()`.

    Args:
        clock: the clock that the vehicle advances.
        selector: the selector that waits for the vehicle.
    """

    def __init__(self, clock: LockstepClock, selector: SettlingSelector) -> None:
        self._clock, self._settling_selector = clock, selector
        self._timer_count = 0
        self._read_clock = clock.read  # stored, because it is called a dozen times in each step
        super().__init__(selector)

    def time(self) -> float:
        """Event-loop time, s: vehicle time from the first beacon on."""
        return self._read_clock()

    def call_at(
        self,
        when: float,
        callback: Callable[[*Arguments], object],
        *args: *Arguments,
        context: Context | None = None,
    ) -> asyncio.TimerHandle:
        """Schedule a timer; timers due at the same time run in the order of scheduling.

        asyncio alone would run such timers in an order that also depends on timers from before the
        first beacon, which were scheduled in wall time.
        """
        self._timer_count += 1
        order = self._timer_count % _TIMERS_IN_ORDER * _TIMER_SPACING_S
        # All timers are set early: a timer late by a picosecond would run a whole step late.
        advance = _TIMERS_IN_ORDER * _TIMER_SPACING_S
        return super().call_at(when - advance + order, callback, *args, context=context)

    def advance(self, vehicle_time: float) -> bool:
        """Set the time to that of a beacon, s; return False if the beacon is not newer."""
        return self._clock.advance(vehicle_time)

    def settle(self, callback: Callable[[], None]) -> None:
        """Run all that is ready and due, without I/O, and then call `callback`."""
        self._settling_selector.settle(callback)


def run(main: Coroutine[Any, Any, T]) -> T:
    """Run `main` like `asyncio.run`, in vehicle time."""
    clock = _BeaconClock()
    selector = _SteppingSelector(clock)
    make_loop = partial(LockstepEventLoop, clock, selector)
    with closing(main), asyncio.Runner(loop_factory=make_loop) as runner:
        return runner.run(main)
