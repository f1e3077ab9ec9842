"""Real-time settings requested from Linux, so that the control loop is not delayed.

A setting applies to the calling thread, which runs the event loop, or to the process. A refused
setting prevents a flight only if `realtime.required` is true.
"""

import ctypes
import errno
import gc
import os
import resource
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from typing import NamedTuple

_MCL_CURRENT, _MCL_FUTURE = 1, 2
_FIFO_REMEDY = (
    "run companion as docs/companion.service does, or allow `rtprio` to its user in "
    "/etc/security/limits.conf"
)
_MEMORY_REMEDY = (
    "run companion as docs/companion.service does, or allow `memlock unlimited` to its user in "
    "/etc/security/limits.conf"
)


def use_normal_scheduler(pid: int) -> None:
    """Give a child process the normal scheduler, whichever this program itself uses."""
    with suppress(ProcessLookupError):  # it has ended already
        os.sched_setscheduler(pid, os.SCHED_OTHER, os.sched_param(0))


@contextmanager
def no_garbage_collection() -> Iterator[None]:
    """Switch Python's garbage collector off in the block."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


class _FrozenState:
    """State of `frozen_objects` in this process.

    Attributes:
        running_blocks: number of `frozen_objects` blocks that are running.
        frozen_by_caller: whether objects were frozen before the first block. Once true it is not
            checked again, because counting frozen objects takes 10 ms for each 100 000.
    """

    running_blocks = 0
    frozen_by_caller = False


@contextmanager
def frozen_objects() -> Iterator[None]:
    """Keep the garbage collector from walking through the objects that exist now (`gc.freeze`).

    These objects are mostly modules and live as long as the program. If some objects were frozen
    before the block, all stay frozen after it, because Python cannot unfreeze only some.
    """
    is_outermost = not _FrozenState.running_blocks
    if is_outermost and not _FrozenState.frozen_by_caller:
        _FrozenState.frozen_by_caller = gc.get_freeze_count() > 0
    gc.collect()
    gc.freeze()
    _FrozenState.running_blocks += 1
    try:
        yield
    finally:
        _FrozenState.running_blocks -= 1
        if is_outermost and not _FrozenState.frozen_by_caller:
            gc.unfreeze()


class RealtimeError(Exception):
    """A required setting was refused; the message gives the reason and the remedy."""


class SettingRefused(Exception):  # noqa: N818 - a refusal is not an error of this program
    """The system refuses a setting; the message gives the reason and the remedy."""


class SettingResult(NamedTuple):
    """A requested setting, and whether it was granted."""

    name: str
    """Key of the setting in the section `realtime`."""
    setting: str
    """The setting in words."""
    refusal: str | None = None
    """Why the setting was refused and how to get it; None: granted."""

    def __str__(self) -> str:
        if self.refusal is None:
            return f"realtime: {self.setting}: granted"
        return f"realtime: {self.setting}: not granted: {self.refusal}"


@dataclass(frozen=True, slots=True)
class RealtimeSettings:
    """The real-time settings to request."""

    fifo_priority: int | None = None
    """Priority under SCHED_FIFO, 1..99; None: keep the present scheduler."""
    processors: tuple[int, ...] = ()
    """Numbers of the processors to run on; empty: any."""
    lock_memory: bool = False
    """Whether to keep all memory in RAM."""
    freeze_gc: bool = False
    """Whether to switch the garbage collector off."""
    required: bool = False
    """Whether a refused setting is an error."""


@contextmanager
def request_settings(settings: RealtimeSettings) -> Iterator[tuple[SettingResult, ...]]:
    """Request all settings; undo the granted ones at the end of the block.

    Raises:
        RealtimeError: a setting is refused, and `settings.required` is true.
    """
    results: list[SettingResult] = []
    with ExitStack() as undo:
        for name, description, apply_setting in _setting_requests(settings):
            try:
                undo.callback(apply_setting())
                results.append(SettingResult(name, description))
            except SettingRefused as refused:
                results.append(SettingResult(name, description, str(refused)))
        refusals = [str(result) for result in results if result.refusal is not None]
        if refusals and settings.required:
            raise RealtimeError(f"{'; '.join(refusals)} (realtime.required is true)")
        yield tuple(results)


_UndoSetting = Callable[[], object]
_ApplySetting = Callable[[], _UndoSetting]


def _setting_requests(settings: RealtimeSettings) -> Iterator[tuple[str, str, _ApplySetting]]:
    """For each requested setting: its key, the setting in words, and a function that applies it."""
    priority, processors = settings.fifo_priority, settings.processors
    if processors:
        numbers = ", ".join(map(str, processors))
        yield "cpu_affinity", f"processor {numbers}", lambda: _set_processors(processors)
    if settings.freeze_gc:
        yield "freeze_gc", "no garbage collection in flight", _stop_collecting
    if settings.lock_memory:
        yield "lock_memory", "memory locked in RAM", _lock_memory
    if priority is not None:  # last: the others take time, at normal priority
        yield (
            "scheduler",
            f"SCHED_FIFO at priority {priority}",
            lambda: _set_fifo_priority(priority),
        )


def _set_fifo_priority(priority: int) -> _UndoSetting:
    scheduler_before, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    # Threads that start later (recording, MAVSDK) must inherit the priority: a preempted thread
    # that holds the interpreter lock would block the control loop.
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except PermissionError:
        raise SettingRefused(f"this user lacks the permission; {_FIFO_REMEDY}") from None
    except OSError as error:
        raise SettingRefused(f"{error.strerror}") from None
    return lambda: os.sched_setscheduler(0, scheduler_before, parameters)


def _set_processors(processors: tuple[int, ...]) -> _UndoSetting:
    processors_before = os.sched_getaffinity(0)
    unavailable = [number for number in processors if number not in processors_before]
    if unavailable:
        raise SettingRefused(
            f"processor {', '.join(map(str, unavailable))} is not available to this program; "
            f"available are {', '.join(map(str, sorted(processors_before)))}"
        )
    try:
        os.sched_setaffinity(0, processors)
    except OSError as error:
        raise SettingRefused(f"{error.strerror}") from None
    return lambda: os.sched_setaffinity(0, processors_before)


def _lock_memory() -> _UndoSetting:
    libc = ctypes.CDLL(None, use_errno=True)
    limit, _ = resource.getrlimit(resource.RLIMIT_MEMLOCK)
    if limit != resource.RLIM_INFINITY and os.geteuid() != 0:
        # Even if the limit suffices now, an allocation in flight could fail.
        raise SettingRefused(f"this user may lock only {limit // 1024} KiB; {_MEMORY_REMEDY}")
    if libc.mlockall(_MCL_CURRENT | _MCL_FUTURE) != 0:
        error_number = ctypes.get_errno()
        if error_number in (errno.EPERM, errno.ENOMEM):
            raise SettingRefused(f"{os.strerror(error_number)}; {_MEMORY_REMEDY}")
        raise SettingRefused(os.strerror(error_number))
    return libc.munlockall


def _stop_collecting() -> _UndoSetting:
    undo = ExitStack()
    undo.enter_context(frozen_objects())
    undo.enter_context(no_garbage_collection())
    return undo.close
