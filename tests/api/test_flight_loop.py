"""The thread of a flight and its event loop, without a flight."""

import asyncio
import signal
import sys
import threading
import time

import pytest

from companion.api.ctrl_c import on_ctrl_c
from companion.api.flight_loop import SWITCH_INTERVAL, OwnThreadLoop, SharedLoop, flight_loop
from companion.api.state import _PendingCall
from companion.safety.actions import FlightEnded


@pytest.fixture(autouse=True)
def threads_ended():
    """The thread of a flight whose end nobody awaited would run on into the next test."""
    yield
    for thread in threading.enumerate():
        if thread.name == "flight":
            thread.join(10.0)


async def where():
    return threading.current_thread().name


async def test_results_errors_and_cancellation_cross_the_threads():
    cancelled = threading.Event()

    async def fails():
        raise ZeroDivisionError("there")

    async def waits():
        try:
            await asyncio.sleep(60.0)
        finally:
            cancelled.set()

    loop = flight_loop()
    assert isinstance(loop, OwnThreadLoop)
    assert await loop.start(where()) == "flight"
    with pytest.raises(ZeroDivisionError):
        await loop.start(fails())
    waiting = loop.start(waits())
    await asyncio.sleep(0.05)
    waiting.cancel()
    with pytest.raises(asyncio.CancelledError):
        await waiting
    await asyncio.sleep(0)
    assert cancelled.wait(5.0)
    told = asyncio.get_running_loop().create_future()
    loop.post(loop.post_to_program, told.set_result, "back")
    assert await told == "back"
    loop.close(wait=True)


async def test_after_its_end_nothing_is_started_and_nobody_waits_for_ever():
    loop = flight_loop()
    waiting = loop.start(asyncio.sleep(60.0))
    loop.close(wait=True)
    with pytest.raises(asyncio.CancelledError):
        await waiting
    loop.post(print, "nobody hears it")
    with pytest.raises(FlightEnded, match="the flight is over"):
        await loop.start(where())


async def test_the_flight_runs_while_the_program_blocks():
    async def ticks():
        began = time.monotonic()
        for _ in range(10):
            await asyncio.sleep(0.01)
        return time.monotonic() - began

    loop = flight_loop()
    flown = loop.start(ticks())
    until = time.monotonic() + 0.4
    while time.monotonic() < until:
        pass
    loop.close(wait=False)
    assert await flown < 0.35


@pytest.mark.parametrize("lost", ["loop", "thread"])
def test_a_program_that_is_lost_has_its_flight_ended(lost):
    ended = threading.Event()

    async def end():
        ended.set()

    async def main():
        flight_loop().register_end(end)

    loop = asyncio.new_event_loop()
    if lost == "loop":
        loop.run_until_complete(main())
        assert not ended.wait(0.3), "a loop that stands still is not lost"
        loop.close()
    else:
        thread = threading.Thread(target=loop.run_until_complete, args=(main(),))
        thread.start()
        thread.join()
    assert ended.wait(5.0)
    loop.close()


async def test_python_changes_threads_quickly_while_any_flight_runs():
    before = sys.getswitchinterval()
    first, second = flight_loop(), flight_loop()
    await first.start(where())
    await second.start(where())
    first.close(wait=True)
    assert sys.getswitchinterval() == pytest.approx(SWITCH_INTERVAL, abs=2e-6)
    second.close(wait=True)
    assert sys.getswitchinterval() == pytest.approx(before)


async def test_a_handler_of_ctrl_c_that_does_not_wake_the_loop_is_heard():
    """Jupyter's handler calls `call_soon`; an interrupted cell went on until its call was done."""
    program, told = asyncio.get_running_loop(), asyncio.Event()
    loop = flight_loop()
    before = signal.signal(signal.SIGALRM, lambda *_: program.call_soon(told.set))
    signal.setitimer(signal.ITIMER_REAL, 0.2)
    began = time.monotonic()
    await asyncio.wait_for(told.wait(), 10.0)
    signal.signal(signal.SIGALRM, before)
    loop.close(wait=True)
    assert time.monotonic() - began < 5.0


async def test_news_do_not_queue_up_while_the_program_does_not_run():
    queued, heard = [], []

    class Blocked(SharedLoop):
        def post_to_program(self, callback, *args):
            queued.append(callback)

    wake = _PendingCall(Blocked(), lambda: heard.append(1))
    for _ in range(1000):
        wake()
    assert len(queued) == 1
    queued.pop()()
    wake()
    assert (len(queued), len(heard)) == (1, 1)


async def test_two_flights_that_overlap_leave_ctrl_c_as_it_was():
    """The first to end left its handler, so a later `asyncio.run` was not cancelled by Ctrl-C."""
    before, flights = signal.getsignal(signal.SIGINT), [OwnThreadLoop(), OwnThreadLoop()]
    first, second = (on_ctrl_c(loop, pytest.fail) for loop in flights)
    first.__enter__()
    second.__enter__()
    assert signal.getsignal(signal.SIGINT) is not before
    for each, loop in zip((first, second), flights, strict=True):
        each.__exit__(None, None, None)
        loop.close(wait=True)
    assert signal.getsignal(signal.SIGINT) is before
