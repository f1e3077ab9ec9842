"""Every test of the link runs on our event loop and on asyncio's own."""

import asyncio
import inspect

import pytest

from companion.mavlink import loop as link_loop


@pytest.fixture(params=["link loop", "stock loop"])
def run(request):
    """Runs a coroutine on our event loop, and again on asyncio's own."""
    return link_loop.run if request.param == "link loop" else asyncio.run


def pytest_pycollect_makeitem(name, obj):
    """A test that is a coroutine uses `run`."""
    if name.startswith("test_") and inspect.iscoroutinefunction(obj):
        pytest.mark.usefixtures("run")(obj)
