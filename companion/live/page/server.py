"""Serves the live page, until its flight has ended and nobody looks any more."""

import asyncio
import os
import socket
import struct
import tempfile
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager

from companion.config import Config
from companion.live.door import leave_address
from companion.live.helper_process import Relay
from companion.live.page.guard import Guard
from companion.live.page.store import Store

_ALONE = 5.0
"""After the flight, a page that nobody has open ends after this long, s."""
_LONGEST = 3600.0
"""After the flight, the page ends after this long, s."""


async def serve_page(relay: Relay, listening: socket.socket) -> None:
    """Serve the page of a flight at a listening socket."""
    # NiceGUI keeps its storage in the working directory unless it is told otherwise.
    with tempfile.TemporaryDirectory(prefix="companion-live-") as storage:
        os.environ["NICEGUI_STORAGE_PATH"] = storage
        await _serve(relay, listening)


async def _serve(relay: Relay, listening: socket.socket) -> None:
    import uvicorn  # noqa: PLC0415  after the path of the storage is set
    from fastapi import FastAPI  # noqa: PLC0415
    from nicegui import Client, ui  # noqa: PLC0415

    from companion.live.page.layout import add_page  # noqa: PLC0415

    store = Store(Config.model_validate(relay.first["config"]))
    relay.listen(store.take)
    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    guard = Guard(app, str(relay.first["token"]))
    add_page(relay, store, guard)
    ui.run_with(
        app, title="companion live", dark=None, message_history_length=300, reconnect_timeout=30.0
    )
    config = uvicorn.Config(guard, log_level="warning", timeout_graceful_shutdown=1)
    server = uvicorn.Server(config)
    serving = asyncio.create_task(server.serve(sockets=[listening]))
    ended = asyncio.create_task(relay.over.wait())
    await asyncio.wait({serving, ended}, return_when=asyncio.FIRST_COMPLETED)
    store.end()

    def watched() -> bool:
        return any(client.has_socket_connection for client in Client.instances.values())

    async with _leave_request(int(relay.first["port"])) as asked:
        quiet = 0.0
        for _ in range(int(_LONGEST)):
            quiet = 0.0 if watched() else quiet + 1.0
            if asked.is_set() or quiet > _ALONE or serving.done():
                break
            done = asyncio.create_task(asked.wait())
            await asyncio.wait({done}, timeout=1.0)
            done.cancel()
    server.should_exit = True
    for each in server.servers:
        each.close()  # the next flight's page waits for the port
    await asyncio.wait({serving, ended}, timeout=3.0)


@asynccontextmanager
async def _leave_request(port: int) -> AsyncGenerator[asyncio.Event, None]:
    """Yield an event; the next flight of the same user sets it when it wants the port."""
    asked = asyncio.Event()

    async def answer(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        sock = writer.get_extra_info("socket")
        credentials = sock.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, struct.calcsize("3i"))
        _, user, _ = struct.unpack("3i", credentials)
        if user == os.getuid():
            writer.write(b"leaving")
            asked.set()
        writer.close()

    try:
        server = await asyncio.start_unix_server(answer, leave_address(port))
    except OSError:  # another page at the same number
        yield asked
        return
    async with server:
        yield asked
