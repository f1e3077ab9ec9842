"""An asyncio event loop on a mock vehicle's time, without sleeping or polling."""

import asyncio
from collections.abc import Callable
from contextvars import Context
from typing import Protocol, TypeVarTuple

from companion.mavlink.lockstep import LockstepEventLoop, SettlingSelector
from companion.mavlink.loop import ReadyKeys

Arguments = TypeVarTuple("Arguments")


class VirtualClock:
    """The clock of one `VirtualEventLoop`.

    Args:
        now: initial time, s.
    """

    def __init__(self, now: float) -> None:
        self.now = now
        self._last_beacon_time: float | None = None

    def read(self) -> float:
        """The loop's time, s."""
        return self.now

    def advance(self, vehicle_time: float) -> bool:
        """Set the clock to the time of a lockstep beacon, s; False if the beacon is not newer."""
        if self._last_beacon_time is not None and vehicle_time <= self._last_beacon_time:
            return False
        self._last_beacon_time = self.now = vehicle_time
        return True


class World(Protocol):
    """The vehicle and the wire to the vehicle: delivers datagrams, and advances the clock."""

    def deliver_due(self) -> object:
        """Deliver the datagrams that arrive at the present time."""
        ...

    def advance(self, until: float) -> None:
        """Advance to the next event, but at most to the time `until`, s."""
        ...


class _VirtualSelector(SettlingSelector):
    """Advances the vehicle, instead of sleeping, until the program has something to do.

    Attributes:
        scheduled_count: number of callbacks and timers that were scheduled so far.
    """

    def __init__(self, clock: VirtualClock, world: World) -> None:
        super().__init__()
        self.scheduled_count = 0
        self._clock, self._world = clock, world

    def wait(self, timeout: float | None) -> ReadyKeys:
        if timeout == 0:
            self._world.deliver_due()
        else:
            until = float("inf") if timeout is None else self._clock.now + timeout
            count_before = self.scheduled_count
            # Most messages only call functions of the program, and schedule nothing.
            while (
                self.scheduled_count == count_before
                and not self.is_settling
                and self._clock.now < until
            ):
                self._world.advance(until)
        return []


class VirtualEventLoop(LockstepEventLoop):
    """An event loop on a virtual clock that `world` advances. File descriptors are not watched."""

    def __init__(self, clock: VirtualClock, world: World) -> None:
        self.clock, self.world = clock, world
        self._virtual_selector = _VirtualSelector(clock, world)
        super().__init__(clock, self._virtual_selector)

    def time(self) -> float:
        """The clock's time, s."""
        return self.clock.now

    def call_soon(
        self,
        callback: Callable[[*Arguments], object],
        *args: *Arguments,
        context: Context | None = None,
    ) -> asyncio.Handle:
        """Schedule a callback; the vehicle waits until it has run."""
        self._virtual_selector.scheduled_count += 1
        return super().call_soon(callback, *args, context=context)

    def call_soon_threadsafe(
        self,
        callback: Callable[[*Arguments], object],
        *args: *Arguments,
        context: Context | None = None,
    ) -> asyncio.Handle:
        """Schedule a callback from another thread; see `call_soon`."""
        self._virtual_selector.scheduled_count += 1
        return super().call_soon_threadsafe(callback, *args, context=context)

    def call_at(
        self,
        when: float,
        callback: Callable[[*Arguments], object],
        *args: *Arguments,
        context: Context | None = None,
    ) -> asyncio.TimerHandle:
        """Schedule a timer; before it runs, the vehicle advances at most to the time `when`.

        In lockstep the vehicle completes the step that contains this time.
        """
        self._virtual_selector.scheduled_count += 1
        return super().call_at(when, callback, *args, context=context)
