"""Keeps the live page and the live stream after the flight for users who have them open."""

import asyncio
import os
import socket
import struct
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager

from companion.live.addresses import release_socket_name

_LONGEST_TIME_WITHOUT_USERS = 5.0
"""Time after which a page or stream without users ends, s."""
_LONGEST_TIME_AFTER_FLIGHT = 3600.0
"""Longest time that a page or stream stays after the flight, s."""


async def until_unused(port: int, is_open: Callable[[], bool]) -> None:
    """Wait until nobody has the page or stream open, or the next flight needs its port.

    Wait at most an hour.
    """
    async with _release_request(port) as release_requested:
        time_without_users = 0.0
        for _ in range(int(_LONGEST_TIME_AFTER_FLIGHT)):
            time_without_users = 0.0 if is_open() else time_without_users + 1.0
            if release_requested.is_set() or time_without_users > _LONGEST_TIME_WITHOUT_USERS:
                break
            request_task = asyncio.create_task(release_requested.wait())
            await asyncio.wait({request_task}, timeout=1.0)
            request_task.cancel()


@asynccontextmanager
async def _release_request(port: int) -> AsyncGenerator[asyncio.Event, None]:
    """Yield an event that the next flight of the same user sets when it needs the port."""
    release_requested = asyncio.Event()

    async def answer(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        sock = writer.get_extra_info("socket")
        credentials = sock.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, struct.calcsize("3i"))
        _, user, _ = struct.unpack("3i", credentials)
        if user == os.getuid():
            writer.write(b"leaving")
            release_requested.set()
        writer.close()

    try:
        server = await asyncio.start_unix_server(answer, release_socket_name(port))
    except OSError:  # another process has this name, so no request can arrive
        yield release_requested
        return
    async with server:
        yield release_requested
