"""`--watch` and `--live`: the helper process beside a flight."""

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console

from companion.config import Config
from companion.extras import require
from companion.live.door import open_door
from companion.live.helper import Helper, Wishes


@contextmanager
def helper(
    options: argparse.Namespace,
    config: Config,
    path: Path,
    read: Config,
    folder: Path | None,
    console: Console,
    *,
    follows: bool,
) -> Iterator[Helper | None]:
    """The helper process that the command line asks for, while the block runs; None: none.

    Args:
        options: of the command line; `watch` and `live` count.
        config: of the flight.
        path: file of the configuration, which `--watch` watches.
        read: the configuration as it was read from this file.
        folder: of the flight, or None.
        console: shows where the live page is.
        follows: whether the flight flies the maneuvers of its configuration.

    Raises:
        ConfigError: the page cannot be served at this address.
        MissingExtraError: the extra `live` is not installed.
    """
    if not options.watch and options.live is None:
        yield None
        return
    door = None
    if options.live is not None:
        require("nicegui", "live", "--live")
        door = open_door(options.live)
        console.print(door.words(), markup=False, highlight=False, soft_wrap=True)
    made = Helper(Wishes(path if options.watch else None, read, door, follows, folder), config)
    if door is not None:
        door.listening.close()  # the process has it
    words = "the program has ended"
    try:
        yield made
        words = "the flight is over"
    finally:
        made.close(words)
