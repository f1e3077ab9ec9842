"""Lockstep: an event loop whose clock the vehicle moves, step by step.

The vehicle ends each of its steps with a beacon, SYSTEM_TIME(time_boot_ms = t), and waits for our
answer. Between beacon and answer everything that is due on our side runs, in vehicle time; then
the answer goes out as the last datagram of the step. Nothing depends on the speed of either side,
so a flight is bit-identical each time, and runs as fast as both can compute.
"""

import asyncio
import os
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Coroutine
from contextvars import Context
from typing import Any, Protocol, TypeVar, TypeVarTuple

from companion.mavlink.loop import HotSelector, LinkEventLoop, Ready

T = TypeVar("T")
Arguments = TypeVarTuple("Arguments")

PATIENCE_S = 2.0
"""Wall time without I/O, s, after which the vehicle counts as gone and time goes on without it."""

_SPIN_S = 0.0005

_TIMERS_IN_ORDER = 1_000_000
_TIMER_SPACING_S = 1e-12  # a million of them are a microsecond, below any step

_MAX_ITERATIONS = (
    200  # of the loop until it counts as settled: a task that never rests must not block
)


class LockstepClock(Protocol):
    """The time of an event loop that the vehicle moves."""

    def read(self) -> float:
        """The loop's time, s."""
        ...

    def advance(self, vehicle_time: float) -> bool:
        """Set vehicle time, s; false for a repeated beacon."""
        ...


class _VehicleClock:
    """Wall time until the vehicle speaks, vehicle time from then on."""

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
        """Set vehicle time; false for a repeated beacon."""
        if self._vehicle is not None and vehicle_time <= self._vehicle:
            if self._vehicle - vehicle_time < 1.0:
                return False
            # The vehicle restarted. Our time does not go back; its time continues from here.
            self._offset += self._vehicle - vehicle_time
        self._vehicle = vehicle_time
        return True

    def start_waiting(self) -> None:
        """The vehicle's turn begins now."""
        self._waiting_since = time.monotonic()

    def patience(self) -> float | None:
        """Wall time in s that is left to the vehicle; `None` before its first beacon."""
        if self._vehicle is None:
            return None
        return max(0.0, self._waiting_since + PATIENCE_S - time.monotonic())

    def go_on_alone(self) -> None:
        """The vehicle did not answer in time: timeouts on our side must still end."""
        self._offset += PATIENCE_S
        self.start_waiting()


class SettlingSelector(HotSelector, ABC):
    """Tells when the loop has nothing left to do."""

    def __init__(self) -> None:
        super().__init__()
        self._when_idle: Callable[[], None] | None = None
        self._iterations = 0

    def settle(self, then: Callable[[], None]) -> None:
        """Call `then` once nothing on the loop is ready any more; no I/O happens before."""
        self._when_idle, self._iterations = then, 0

    @property
    def settling(self) -> bool:
        """Whether a step is open: what is ready or due runs, and no I/O happens."""
        return self._when_idle is not None

    def select(self, timeout: float | None = None) -> Ready:
        """Settle an open step; otherwise wait for the vehicle."""
        if self._when_idle is None:
            return self.wait(timeout)
        # The loop polls with timeout 0 exactly when callbacks or timers are ready.
        self._iterations += 1
        if timeout != 0 or self._iterations > _MAX_ITERATIONS:
            then, self._when_idle = self._when_idle, None
            then()
        return []

    @abstractmethod
    def wait(self, timeout: float | None) -> Ready:
        """Wait as every selector does."""


class _SteppingSelector(SettlingSelector):
    """Never lets a timer wait on the wall clock while the vehicle is there."""

    def __init__(self, clock: _VehicleClock) -> None:
        super().__init__()
        self._clock = clock

    def select(self, timeout: float | None = None) -> Ready:
        was_settling = self.settling
        ready = super().select(timeout)
        if was_settling and not self.settling:
            self._clock.start_waiting()
        return ready

    def wait(self, timeout: float | None) -> Ready:
        left = None if timeout == 0 else self._clock.patience()
        if left is None:
            return HotSelector.select(self, timeout)
        ready = self._spin()
        if not ready and not self.settling:
            ready = HotSelector.select(self, left)
        if not self.settling and self._clock.patience() == 0.0:
            self._clock.go_on_alone()
        return ready

    def _spin(self) -> Ready:
        """Poll for the next beacon without sleeping: being woken takes longer."""
        give_up = time.perf_counter() + _SPIN_S
        while time.perf_counter() < give_up:
            ready = HotSelector.select(self, 0)
            if ready or self.settling:
                return ready
            os.sched_yield()  # let other processes use this core
        return []


class LockstepEventLoop(LinkEventLoop):
    """An event loop in vehicle time: `time()` moves only by `advance`.

    Before the first beacon, and when nothing has been heard for 2 s of wall time, it runs on wall
    time, so that waiting for a vehicle that is not there ends by the usual timeouts.

    Args:
        clock: another clock than that, with the selector that moves it.
        selector: waits for the vehicle.
    """

    def __init__(
        self, clock: LockstepClock | None = None, selector: SettlingSelector | None = None
    ) -> None:
        if clock is None or selector is None:
            clock = wall_or_vehicle = _VehicleClock()
            selector = _SteppingSelector(wall_or_vehicle)
        self._clock: LockstepClock = clock
        self._stepping = selector
        self._scheduled_so_far = 0
        self._read_clock = clock.read  # asyncio and the link ask a dozen times a step
        super().__init__(self._stepping)

    def time(self) -> float:
        """Vehicle time in s."""
        return self._read_clock()

    def call_at(
        self,
        when: float,
        callback: Callable[[*Arguments], object],
        *args: *Arguments,
        context: Context | None = None,
    ) -> asyncio.TimerHandle:
        """As every loop's, but timers due at the same time run in the order of scheduling.

        asyncio leaves the order of such timers to the shape of its heap, and that shape depends
        on timers of the time before the first beacon, which was wall time.
        """
        self._scheduled_so_far += 1
        order = self._scheduled_so_far % _TIMERS_IN_ORDER * _TIMER_SPACING_S
        early = _TIMERS_IN_ORDER * _TIMER_SPACING_S  # never later than asked: that is a step late
        return super().call_at(when - early + order, callback, *args, context=context)

    def advance(self, vehicle_time: float) -> bool:
        """Move the clock to a beacon's time; false if that beacon was seen before."""
        return self._clock.advance(vehicle_time)

    def settle(self, then: Callable[[], None]) -> None:
        """Run all that is ready and due, without any I/O, and then `then`."""
        self._stepping.settle(then)


def run(main: Coroutine[Any, Any, T]) -> T:
    """Like `asyncio.run`, in vehicle time."""
    with asyncio.Runner(loop_factory=LockstepEventLoop) as runner:
        return runner.run(main)
