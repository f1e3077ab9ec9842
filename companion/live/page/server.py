"""Serves the live page during the flight, and afterwards while somebody has the page open."""

import asyncio
import os
import socket
import tempfile

from companion.config import Config
from companion.live.after_flight import until_unused
from companion.live.helper_process import FlightConnection
from companion.live.page.guard import Guard
from companion.live.page.page_data import PageData


async def serve_page(connection: FlightConnection, page_socket: socket.socket) -> None:
    """Serve the live page of a flight at the listening socket `page_socket`."""
    # NiceGUI keeps its storage in the working directory unless it is told otherwise.
    with tempfile.TemporaryDirectory(prefix="companion-live-") as storage:
        os.environ["NICEGUI_STORAGE_PATH"] = storage
        await _serve(connection, page_socket)


async def _serve(connection: FlightConnection, page_socket: socket.socket) -> None:
    import uvicorn  # noqa: PLC0415  after the path of the storage is set
    from fastapi import FastAPI  # noqa: PLC0415
    from nicegui import Client, ui  # noqa: PLC0415

    from companion.live.page.layout import add_page  # noqa: PLC0415

    page_data = PageData(Config.model_validate(connection.first_message["config"]))
    connection.listen(page_data.take)
    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    guard = Guard(app, str(connection.first_message["token"]))
    add_page(connection, page_data, guard)
    ui.run_with(
        app, title="companion live", dark=None, message_history_length=300, reconnect_timeout=30.0
    )
    config = uvicorn.Config(guard, log_level="warning", timeout_graceful_shutdown=1)
    server = uvicorn.Server(config)
    server_task = asyncio.create_task(server.serve(sockets=[page_socket]))
    end_task = asyncio.create_task(connection.flight_ended.wait())
    await asyncio.wait({server_task, end_task}, return_when=asyncio.FIRST_COMPLETED)
    page_data.end()

    def is_open() -> bool:
        return any(client.has_socket_connection for client in Client.instances.values())

    unused_task = asyncio.create_task(until_unused(int(connection.first_message["port"]), is_open))
    await asyncio.wait({unused_task, server_task}, return_when=asyncio.FIRST_COMPLETED)
    unused_task.cancel()
    server.should_exit = True
    for each in server.servers:
        each.close()  # the next flight's page waits for the port
    await asyncio.wait({server_task, end_task}, timeout=3.0)
