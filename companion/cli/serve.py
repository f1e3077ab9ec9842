"""`companion serve`."""

import argparse
import asyncio
import json
import signal
from typing import Any

from rich.console import Console

from companion.cli.exit_codes import EXIT_OK
from companion.config import Config
from companion.config.files import assigned, changed, load
from companion.files.yaml_file import ConfigError
from companion.mavlink import loop as link_loop
from companion.mavlink.errors import EndpointError
from companion.mavlink.transport.endpoint import parse_endpoint
from companion.serve.session import ServeSession


def serve(options: argparse.Namespace) -> int:
    """Pass everything between the vehicle and other programs."""
    config = _as_told(load(options.config), options)
    console = Console(stderr=options.json, highlight=False)

    def note(text: str) -> None:
        console.print(text, markup=False, soft_wrap=True)

    counters = link_loop.run(_until_stopped(ServeSession(config, note)))
    if options.json:
        print(json.dumps(counters))
    return EXIT_OK


async def _until_stopped(session: ServeSession) -> dict[str, Any]:
    """Run a session until SIGINT (Ctrl-C), SIGTERM or SIGHUP."""
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        loop.add_signal_handler(number, session.stop)
    return await session.run()


def _as_told(config: Config, options: argparse.Namespace) -> Config:
    """The configuration with what the command line says otherwise.

    Raises:
        ConfigError: the two do not go together.
    """
    told = changed(config, assigned(options.set), "--set")
    link = {"endpoint": options.endpoint} if options.endpoint else {}
    clients = {"clients": options.client} if options.client else {}
    told = changed(told, {"link": link, "serve": clients}, "the command line")
    if told.link.lockstep:
        raise ConfigError("link.lockstep: clients have no part in it; serve runs in real time")
    for endpoint in told.serve.clients:
        try:
            parse_endpoint(endpoint)
        except EndpointError as error:
            raise ConfigError(f"serve.clients: {error}") from error
    return told
