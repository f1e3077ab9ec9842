"""Property tests try the same cases on every machine, however slow it is just now."""

import asyncio
import gc
import os
import signal
from inspect import iscoroutinefunction

import pytest
from hypothesis import settings

# As the command line does: with more threads the tests of fits take 2.4 times the CPU time.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# Started by `nohup` or in the background of a script, this process ignores them, and so would all
# programs that the tests start and interrupt.
signal.signal(signal.SIGHUP, signal.SIG_DFL)
signal.signal(signal.SIGINT, signal.default_int_handler)

settings.register_profile("same", derandomize=True, deadline=None)
settings.load_profile("same")

# Collecting the tests makes objects that stay: looking for garbage among them takes a second.
gc.disable()


@pytest.fixture(autouse=True, scope="session")
def state_directory(tmp_path_factory):
    """Time stamps of signatures are never kept in the home of whoever runs the tests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))
        yield


@pytest.fixture(autouse=True, scope="session")
def empty_working_folder(tmp_path_factory):
    """What somebody flew in this folder, as by `make demo`, counts in no test."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("here"))
        yield


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem):
    """A test that is a coroutine function runs in an event loop, by its fixture `run` if any."""
    if not iscoroutinefunction(pyfuncitem.obj):
        return None
    arguments = {name: pyfuncitem.funcargs[name] for name in pyfuncitem._fixtureinfo.argnames}
    pyfuncitem.funcargs.get("run", asyncio.run)(pyfuncitem.obj(**arguments))
    return True


def pytest_collection_finish():
    """What was imported by now stays: to walk through it again and again costs flights a tenth.

    Of the rest little is garbage, and it is looked for more rarely.
    """
    gc.freeze()
    gc.set_threshold(200_000, 20, 50)
    gc.enable()
