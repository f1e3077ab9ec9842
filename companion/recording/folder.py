"""Makes the folder of a flight, and says before the flight if the disk is nearly full."""

import shutil
from datetime import UTC, datetime
from pathlib import Path

from companion.files.yaml_file import ConfigError
from companion.recording.tlog import TLOG_FILE

_BYTES_PER_S = 160_000
"""Measured size of the recording of 1 s with 250 attitude samples, bytes."""
_MIN_RECORDING_TIME = 600.0
"""Duration of a recording, s; `space_warning` warns if the disk has room for less."""


def flight_folder(directory: Path) -> Path:
    """Make a folder for one flight, named by its start in UTC.

    Raises:
        ConfigError: the folder cannot be made.
    """
    base = directory / datetime.now(UTC).strftime("%Y-%m-%dT%H-%M-%SZ")
    for number in range(1, 100):
        folder = base if number == 1 else base.with_name(f"{base.name}-{number}")
        try:
            folder.mkdir(parents=True)
        except FileExistsError:
            continue
        except OSError as error:
            raise ConfigError(
                f"recording.directory: cannot make {folder}: {error.strerror}"
            ) from error
        return folder
    raise ConfigError(
        f"recording.directory: {base} and 98 more folders with the same time exist already; start "
        "the flight again"
    )


def make_named_folder(folder: Path) -> Path:
    """Make the folder that the user names for one flight, unless it exists.

    Raises:
        ConfigError: the folder cannot be made, or it holds the records of a flight.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(f"folder: cannot make {folder}: {error.strerror}") from error
    if (folder / TLOG_FILE).exists():
        raise ConfigError(f"folder: {folder} holds a flight already; name another folder")
    return folder


def space_warning(folder: Path) -> str | None:
    """A sentence if the disk of `folder` has room for only a few minutes of recording, else None.

    None also if the file system does not say how much room it has.
    """
    try:
        free_bytes = shutil.disk_usage(folder).free
    except OSError:
        return None
    duration = free_bytes / _BYTES_PER_S
    if duration >= _MIN_RECORDING_TIME:
        return None
    return (
        f"{folder}: the disk has {free_bytes / 1e6:.0f} MB left, enough to record about "
        f"{duration:.0f} s; then the recording stops, and the flight goes on. Make room there "
        "before take-off, or set recording.directory to another disk"
    )
