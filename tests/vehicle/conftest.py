"""Every test of the link runs on our event loop and on asyncio's own."""

from tests.mavlink.conftest import pytest_pycollect_makeitem, pytest_pyfunc_call, run

__all__ = ["pytest_pycollect_makeitem", "pytest_pyfunc_call", "run"]
