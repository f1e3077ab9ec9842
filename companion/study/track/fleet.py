"""Many flights at once, one a core; each is the same to the bit wherever it is flown."""

import os
import signal
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager
from multiprocessing import get_context

from companion.study.outcome import Tick
from companion.study.track.flight import Tracked, fly
from companion.study.track.task import Task

Flown = dict[Task, Tracked]


def fly_all(tasks: Sequence[Task], tick: Tick) -> Flown:
    """Fly every task; ticks as each begins.

    Interrupted, it waits for the flights that are in the air, so that no vehicle is left behind.

    Raises:
        ConfigError, VehicleStoppedError: as `fly`, once it is known of any of them.
    """
    cores = len(os.sched_getaffinity(0))
    flown: dict[Task, Future[Tracked]] = {}
    with ProcessPoolExecutor(min(cores, len(tasks)), get_context("spawn")) as pool:
        for task in tasks:
            _await_a_free_core(list(flown.values()), cores)
            tick(str(task))
            with _interrupts_held():
                flown[task] = pool.submit(fly, task)
        return {task: future.result() for task, future in flown.items()}


@contextmanager
def _interrupts_held() -> Iterator[None]:
    """What is started meanwhile inherits this, so that Ctrl-C reaches the first process alone."""
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def _await_a_free_core(flights: Sequence[Future[Tracked]], cores: int) -> None:
    in_the_air = [flight for flight in flights if not flight.done()]
    if len(in_the_air) >= cores:
        wait(in_the_air, return_when=FIRST_COMPLETED)
    for flight in flights:
        if flight.done():
            flight.result()  # raises what went wrong, before more is begun
