"""Every test of sockets runs on our event loop and on asyncio's own."""

from tests.mavlink.conftest import run

__all__ = ["run"]
