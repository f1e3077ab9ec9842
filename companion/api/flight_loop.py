"""The event loop in which a program's flight runs: a loop in its own thread, or the program's.

With a thread for the flight, a program that computes, blocks or never yields delays only its own
commands. The flight continues to answer attitude samples with setpoints, notices the missing
commands, and hands the vehicle back.

`OwnThreadLoop` and `SharedLoop` have the same methods, which the program calls from its own loop.
"""

import asyncio
import sys
import threading
from collections.abc import Awaitable, Callable, Coroutine, Iterator
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from typing import Any, TypeVar, TypeVarTuple

from companion.api.program import flight_ended
from companion.mavlink.lockstep import LockstepEventLoop
from companion.mavlink.loop import LinkEventLoop

T = TypeVar("T")
Arguments = TypeVarTuple("Arguments")

SWITCH_INTERVAL = 5e-5
"""Time for which a busy thread of the program keeps the interpreter, s. Python's default of 5 ms
would delay each setpoint by several times 5 ms, because every system call of the flight releases
the interpreter.
"""

_PROGRAM_CHECK_PERIOD = 0.1
"""Period with which the flight checks whether the program still exists, s."""


class SharedLoop:
    """Runs the flight in the program's own loop, for a vehicle whose time waits for the program.

    The vehicle's time waits in lockstep, and on the virtual clock of `companion.testing`.

    Attributes:
        time: returns the time of the flight's loop, s.
    """

    def __init__(self) -> None:
        self.time = asyncio.get_running_loop().time

    def start(self, work: Coroutine[Any, Any, T]) -> asyncio.Future[T]:
        """Run the coroutine as a task."""
        return asyncio.ensure_future(work)

    def post(self, callback: Callable[[*Arguments], object], *args: *Arguments) -> None:
        """Call `callback(*args)` at once."""
        callback(*args)

    post_to_program = post

    def register_end(self, end: Callable[[], Awaitable[object]]) -> None:
        """Do nothing: the flight ends with the loop."""

    def close(self, *, wait: bool) -> None:
        """Do nothing, because the loop continues."""


class OwnThreadLoop:
    """Runs the flight in a thread of its own, which is started at once.

    If the program's loop or thread ends without `close`, the flight hands the vehicle back. Python
    waits for the end of this hand-back before it exits.

    Attributes:
        time: returns the time of the flight's loop, s.
    """

    def __init__(self) -> None:
        self._end_flight: Callable[[], Awaitable[object]] | None = None
        self._program = asyncio.get_running_loop()
        self._program_thread = threading.current_thread()
        self._loop = LinkEventLoop()
        self.time = self._loop.time
        self._closing = asyncio.Event()
        self._unfinished: set[Future[Any]] = set()
        self._thread = threading.Thread(target=self._run, name="flight")
        self._thread.start()

    def start(self, work: Coroutine[Any, Any, T]) -> asyncio.Future[T]:
        """Run the coroutine as a task of the flight's loop; cancelling the future cancels the task.

        Raises:
            FlightEnded: the flight is over.
        """
        try:
            future = asyncio.run_coroutine_threadsafe(work, self._loop)
        except RuntimeError as error:  # the loop is closed
            work.close()
            raise flight_ended("ok") from error
        self._unfinished.add(future)
        future.add_done_callback(self._unfinished.discard)
        return asyncio.wrap_future(future)

    def post(self, callback: Callable[[*Arguments], object], *args: *Arguments) -> None:
        """Schedule `callback(*args)` in the flight's loop; ignored after the flight has ended."""
        with suppress(RuntimeError):
            self._loop.call_soon_threadsafe(callback, *args)

    def post_to_program(self, callback: Callable[[*Arguments], object], *args: *Arguments) -> None:
        """Schedule `callback(*args)` in the program's loop; ignored after that loop has ended."""
        with suppress(RuntimeError):
            self._program.call_soon_threadsafe(callback, *args)

    def register_end(self, end: Callable[[], Awaitable[object]]) -> None:
        """Set `end`, which the flight's loop awaits before the flight's thread ends."""
        self._end_flight = end

    def close(self, *, wait: bool) -> None:
        """End the flight, if it still runs, and its thread; with `wait`, return after their end."""
        self.post(self._closing.set)
        if wait:
            self._thread.join()

    def _run(self) -> None:
        try:
            with (
                fast_thread_switching(),
                asyncio.Runner(loop_factory=lambda: self._loop) as runner,
            ):
                runner.run(self._until_closed())
        finally:
            for future in tuple(self._unfinished):  # else its caller would wait for ever
                future.cancel()

    async def _until_closed(self) -> None:
        while not self._closing.is_set() and not self._program_is_lost():
            # Jupyter's handler of Ctrl-C schedules its callback without waking the program's loop.
            self.post_to_program(lambda: None)
            with suppress(TimeoutError):
                await asyncio.wait_for(self._closing.wait(), _PROGRAM_CHECK_PERIOD)
        if self._end_flight is not None:
            await self._end_flight()

    def _program_is_lost(self) -> bool:
        """Whether the program's loop or thread has ended, or is ending with the interpreter."""
        thread = self._program_thread
        is_ending = thread.daemon and not threading.main_thread().is_alive()
        return is_ending or not thread.is_alive() or self._program.is_closed()


_switch_interval_lock = threading.Lock()
_switch_intervals_before: list[float] = []
"""`sys.getswitchinterval()` at the start of each running flight, s. When no flight runs any more,
the value from before the first flight is restored."""


@contextmanager
def fast_thread_switching() -> Iterator[None]:
    """Let Python switch threads after `SWITCH_INTERVAL` while any flight runs."""
    with _switch_interval_lock:
        _switch_intervals_before.append(sys.getswitchinterval())
        sys.setswitchinterval(min(SWITCH_INTERVAL, _switch_intervals_before[0]))
    try:
        yield
    finally:
        with _switch_interval_lock:
            interval_before = _switch_intervals_before[0]
            _switch_intervals_before.pop()
            if not _switch_intervals_before:
                sys.setswitchinterval(interval_before)


FlightLoop = SharedLoop | OwnThreadLoop


def flight_loop() -> FlightLoop:
    """The loop for a flight of the running program.

    In lockstep and on a virtual clock it is the program's own loop, because the vehicle waits for
    the program.
    """
    return SharedLoop() if _vehicle_waits() else OwnThreadLoop()


async def call_in_thread(function: Callable[[*Arguments], T], *arguments: *Arguments) -> T:
    """Call a slow function in a thread, so that samples are still answered.

    In lockstep and on a virtual clock the vehicle waits for us, so the function is called directly.
    """
    if _vehicle_waits():
        return function(*arguments)
    return await asyncio.to_thread(function, *arguments)


def _vehicle_waits() -> bool:
    """Whether the vehicle's time stands still while the event loop works, as in lockstep.

    If time stands still, a thread would only make the order of events random.
    """
    return isinstance(asyncio.get_running_loop(), LockstepEventLoop)
