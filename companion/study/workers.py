"""Runs studies in worker processes; each process runs one study at a time."""

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from typing import Any, NamedTuple

from companion.child_process import end_with_parent, interrupts_blocked
from companion.study.outcome import Outcome, Tick

RunStudy = Callable[[str, Tick], Outcome]
"""Runs the study with the given name, and writes its files. Workers import the function, so it must
be defined at the top of a module."""

_POLL_S = 0.05
"""Time between two reads of the workers' progress, s."""


class _Channels(NamedTuple):
    """Queue and event that a worker shares with the main process."""

    tick_queue: Any
    """Queue of (study, part of the study that begins), filled by the workers."""
    stop_event: Any
    """Event, set when the run is interrupted."""


_worker_channels: list[_Channels] = []
"""The `_Channels` of this worker process; queues can only be passed to a process when it starts."""


class _StoppedError(Exception):
    """Ends the study of a worker after the run was interrupted."""


def run_in_workers(
    run_study: RunStudy,
    progress_steps: Mapping[str, int],
    workers: int,
    tick: Callable[[str, str], None],
) -> dict[str, Outcome]:
    """Run studies in worker processes. On Ctrl-C each study ends after its present part.

    Args:
        run_study: runs one study; a function at the top level of a module.
        progress_steps: number of steps, such as flights, by name of the study. Studies with more
            steps begin first, because they take longer.
        workers: number of processes.
        tick: called in this process with study and part, soon after a part begins.

    Returns:
        the outcomes by study, in the order of `progress_steps`.

    Raises:
        OSError: a result cannot be written, or a worker was killed.
        Exception: whatever a study raises.
    """
    context = get_context("spawn")
    channels = _Channels(context.SimpleQueue(), context.Event())
    pool = ProcessPoolExecutor(workers, context, _start_worker, (channels, os.getpid()))
    try:
        with interrupts_blocked():
            futures = {
                name: pool.submit(_run_one, run_study, name)
                for name in sorted(progress_steps, key=lambda name: -progress_steps[name])
            }
        _forward_ticks(list(futures.values()), channels.tick_queue, tick)
        return {name: futures[name].result() for name in progress_steps}
    except BrokenProcessPool as error:
        raise OSError(
            "a worker process was killed, perhaps for lack of memory; run again with --workers 1"
        ) from error
    finally:
        channels.stop_event.set()
        pool.shutdown(cancel_futures=True)


def _forward_ticks(
    futures: Sequence[Future[Outcome]], tick_queue: Any, tick: Callable[[str, str], None]
) -> None:
    """Pass the workers' progress to `tick` until all studies have ended or one has failed."""
    pending = set(futures)
    while pending:
        done, pending = wait(pending, timeout=_POLL_S)
        while not tick_queue.empty():
            tick(*tick_queue.get())
        for future in done:
            future.result()  # raises the study's exception


def _start_worker(channels: _Channels, parent_pid: int) -> None:
    """Store the channels when a worker process starts."""
    end_with_parent(parent_pid)
    _worker_channels.append(channels)


def _run_one(run_study: RunStudy, name: str) -> Outcome:
    """Run one study in a worker process."""
    (channels,) = _worker_channels

    def tick(part: str) -> None:
        if channels.stop_event.is_set():
            raise _StoppedError
        channels.tick_queue.put((name, part))

    return run_study(name, tick)
