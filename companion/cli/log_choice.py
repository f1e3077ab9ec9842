"""Which MAVLink log `companion identify --log` means, or what to give instead."""

import shlex
from pathlib import Path

from companion.mavlink.errors import LogError

LOG = "flight.tlog"
"""MAVLink log in the folder of a flight."""


def log_of(given: Path) -> Path:
    """The log that `--log` names: a file, or the log in the folder of a flight.

    Raises:
        LogError: there is none; the message names the log that was probably meant.
    """
    log = given / LOG if given.is_dir() else given
    if log.is_file() and log.suffix != ".mcap":
        return log
    if given.is_dir():
        fault, meant = f"holds no {LOG}", _suggestion(given)
    elif not given.exists():
        fault, meant = "does not exist", _suggestion(given.parent)
    else:
        fault, meant = "is no MAVLink log", _suggestion(given.parent)
    raise LogError(
        f"{given} {fault}: --log takes the folder of a flight, or a MAVLink log such as the "
        f"flight.tlog in it{meant}"
    )


def _suggestion(folder: Path) -> str:
    """The end of a message: the log in a folder, else the newest flight in a folder of flights."""
    if (folder / LOG).is_file():
        return f"; write --log {shlex.quote(str(folder / LOG))}"
    flights = sorted(folder.glob(f"*/{LOG}"), key=lambda log: log.stat().st_mtime)
    if flights:
        return f"; write --log {shlex.quote(str(flights[-1].parent))}"
    others = sorted(folder.glob("*.tlog"))
    return f"; write --log {shlex.quote(str(others[0]))}" if others else ""
