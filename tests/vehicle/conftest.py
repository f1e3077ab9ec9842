"""Every test of the link runs on our event loop and on asyncio's own."""

from tests.mavlink.conftest import pytest_pycollect_makeitem, run

__all__ = ["pytest_pycollect_makeitem", "run"]
