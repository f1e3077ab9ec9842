"""`--watch`, `--live` and `--foxglove`: the helper process beside a flight."""

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from rich.console import Console

from companion.config import Config
from companion.extras import require
from companion.flight.environment import THIS_COMPUTER, Environment
from companion.live.addresses import open_page_socket, stream_address
from companion.live.helper import Helper, HelperTasks


@contextmanager
def helper_process(
    options: argparse.Namespace,
    config: Config,
    path: Path,
    config_as_read: Config,
    folder: Path | None,
    console: Console,
) -> Iterator[Helper | None]:
    """Run the helper process that the options demand, if any, while the block runs.

    Args:
        options: the options of the command line.
        config: the configuration of the flight.
        path: the configuration file, which `--watch` watches.
        config_as_read: the configuration read from `path`, without the options.
        folder: the flight's folder; None: other programs command the flights (`serve`).
        console: shows the addresses of the live page and the live stream.

    Raises:
        ConfigError: the page or the stream cannot be served at the address of its option.
        MissingExtraError: an extra is not installed.
    """
    if not options.watch and options.live is None and options.foxglove is None:
        yield None
        return
    if options.live is not None:
        require("nicegui", "live", "--live")
    if options.foxglove is not None:
        require("foxglove", "foxglove", "--foxglove")
    page_socket = None if options.live is None else open_page_socket(options.live)
    # After the page, so that a port given to both is refused.
    foxglove_address = None if options.foxglove is None else stream_address(options.foxglove)
    for address in (page_socket, foxglove_address):
        if address is not None:
            console.print(address.address_text(), highlight=False, soft_wrap=True)
    watched_config = path if options.watch else None
    tasks = HelperTasks(
        watched_config, config_as_read, page_socket, foxglove_address, folder is not None, folder
    )
    helper = Helper(tasks, config)
    if page_socket is not None:
        page_socket.listening_socket.close()  # the helper process has its own copy
    reason = "the program has ended"
    try:
        yield helper
        reason = "the flight is over"
    finally:
        helper.close(reason)


def flight_environment(helper: Helper | None) -> Environment:
    """The `Environment` of a flight: this computer, and the live stream of the helper process."""
    if helper is None or helper.feed is None:
        return THIS_COMPUTER
    return replace(THIS_COMPUTER, send_batch=helper.feed.send)
