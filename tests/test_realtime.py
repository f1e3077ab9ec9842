"""What is asked of the operating system: granted, refused, required, and given back."""

import ctypes
import errno
import gc
import os
import resource
import subprocess
import sys

import pytest

from companion import realtime
from companion.realtime import RealtimeError, RealtimeSettings, request_settings


def refusals(settings):
    with request_settings(settings) as grants:
        return [grant.refusal for grant in grants]


def test_who_asks_for_nothing_gets_nothing():
    assert refusals(RealtimeSettings(required=True)) == []


def test_what_this_computer_surely_grants_is_granted_and_given_back():
    before = os.sched_getaffinity(0)
    one = (min(before),)
    with request_settings(
        RealtimeSettings(processors=one, freeze_gc=True, required=True)
    ) as grants:
        assert [str(grant) for grant in grants] == [
            f"realtime: processor {one[0]}: granted",
            "realtime: no garbage collection in flight: granted",
        ]
        assert os.sched_getaffinity(0) == set(one)
        assert not gc.isenabled()
        assert gc.get_freeze_count() > 0
    assert os.sched_getaffinity(0) == before
    assert gc.isenabled()


@pytest.fixture
def unfrozen(monkeypatch):
    """Called with the number of frozen objects; returns the calls that unfreeze and that count."""
    calls, counted = [], []

    def told(frozen_by_caller):
        monkeypatch.setattr(gc, "get_freeze_count", lambda: counted.append(1) or frozen_by_caller)
        return calls, counted

    monkeypatch.setattr(gc, "unfreeze", lambda: calls.append("unfrozen"))
    monkeypatch.setattr(realtime._FrozenState, "frozen_by_caller", False)
    return told


def test_what_was_frozen_for_a_flight_is_unfrozen_at_the_end_of_the_outermost_block(unfrozen):
    calls, _ = unfrozen(frozen_by_caller=0)
    for flights in (1, 2):
        with realtime.frozen_objects():
            with realtime.frozen_objects():
                pass
            assert len(calls) == flights - 1
        assert len(calls) == flights


def test_what_the_caller_froze_stays_frozen_and_is_counted_once(unfrozen):
    calls, counted = unfrozen(frozen_by_caller=100)
    for _ in range(2):
        with realtime.frozen_objects(), realtime.frozen_objects():
            pass
    assert (calls, len(counted)) == ([], 1)


TRUTH = """
import os, subprocess, sys
from concurrent.futures import ThreadPoolExecutor
from companion import realtime

def policies_elsewhere():
    "Of a thread that begins now, and of a process that is to be as every other."
    with ThreadPoolExecutor(1) as pool:
        in_a_thread = pool.submit(os.sched_getscheduler, 0).result()
    process = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    with process:
        realtime.use_normal_scheduler(process.pid)
        in_a_process = os.sched_getscheduler(process.pid)
        process.communicate(b"\\n")
    return in_a_thread, in_a_process

before = os.sched_getscheduler(0)
settings = realtime.RealtimeSettings(fifo_priority=7, lock_memory=True)
with realtime.request_settings(settings) as grants:
    memory, scheduler = grants
    assert (os.sched_getscheduler(0) == os.SCHED_FIFO) == (scheduler.refusal is None)
    if scheduler.refusal is None:
        assert os.sched_getparam(0).sched_priority == 7
    with open("/proc/self/status") as status:
        (locked,) = (int(line.split()[1]) for line in status if line.startswith("VmLck"))
    assert (locked > 0) == (memory.refusal is None)
    in_a_thread, in_a_process = policies_elsewhere()
    assert in_a_thread == os.sched_getscheduler(0)
    assert in_a_process == os.SCHED_OTHER
assert os.sched_getscheduler(0) == before
"""
"""In a process of its own: to lock all the memory of this one takes seconds."""


def test_the_truth_is_told_of_the_scheduler_and_of_memory():
    """Whatever this computer allows: what is told is what then is so."""
    told = subprocess.run(
        [sys.executable, "-c", TRUTH], capture_output=True, text=True, check=False
    )
    assert told.returncode == 0, told.stderr


def test_a_user_who_may_not_is_told_how_he_may(monkeypatch):
    def refuse(*_):
        raise PermissionError(errno.EPERM, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    (why,) = refusals(RealtimeSettings(fifo_priority=50))
    assert "this user lacks the permission" in why
    assert "docs/companion.service" in why
    assert "rtprio" in why


def test_a_limit_that_only_just_suffices_is_refused_for_it_would_end_a_flight(monkeypatch):
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    monkeypatch.setattr(resource, "getrlimit", lambda _: (8 << 20, 8 << 20))
    (why,) = refusals(RealtimeSettings(lock_memory=True))
    assert "may lock only 8192 KiB" in why
    assert "memlock unlimited" in why


@pytest.mark.parametrize("number", [errno.ENOMEM, errno.EPERM])
def test_a_kernel_that_does_not_lock_is_believed(monkeypatch, number):
    class Libc:
        def mlockall(self, flags):
            ctypes.set_errno(number)
            return -1

    monkeypatch.setattr(ctypes, "CDLL", lambda *_, **__: Libc())
    (why,) = refusals(RealtimeSettings(lock_memory=True))
    assert why.startswith(os.strerror(number))


def test_a_processor_that_is_not_there_is_named():
    (why,) = refusals(RealtimeSettings(processors=(1023,)))
    assert why.startswith("processor 1023 is not available to this program; available are ")


def test_what_is_required_and_refused_is_raised_and_the_rest_given_back():
    with (
        pytest.raises(RealtimeError, match=r"processor 1023: not granted.*realtime\.required"),
        request_settings(RealtimeSettings(processors=(1023,), freeze_gc=True, required=True)),
    ):
        raise AssertionError("nothing may fly")
    assert gc.isenabled()


def test_the_priority_is_taken_last():
    """Else what takes long (the collection before the freeze) would be done at that priority."""
    taken = [name for name, *_ in realtime._setting_requests(RealtimeSettings(1, (0,), True, True))]
    assert taken[-1] == "scheduler"


def test_another_error_of_the_kernel_is_told_without_the_permission(monkeypatch):
    class Libc:
        def mlockall(self, flags):
            ctypes.set_errno(errno.EAGAIN)
            return -1

    def refuse(*_):
        raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))

    monkeypatch.setattr(os, "geteuid", lambda: 0)
    monkeypatch.setattr(ctypes, "CDLL", lambda *_, **__: Libc())
    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    monkeypatch.setattr(os, "sched_setaffinity", refuse)
    here = min(os.sched_getaffinity(0))
    for settings, words in (
        (RealtimeSettings(lock_memory=True), os.strerror(errno.EAGAIN)),
        (RealtimeSettings(fifo_priority=50), os.strerror(errno.EINVAL)),
        (RealtimeSettings(processors=(here,)), os.strerror(errno.EINVAL)),
    ):
        assert refusals(settings) == [words]


def test_a_collector_that_the_caller_stopped_stays_stopped():
    gc.disable()
    try:
        with request_settings(RealtimeSettings(freeze_gc=True)):
            assert not gc.isenabled()
        assert not gc.isenabled()
    finally:
        gc.enable()
