"""Makes the folder of a flight."""

from datetime import UTC, datetime
from pathlib import Path

from companion.files.yaml_file import ConfigError


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
    raise ConfigError(f"recording.directory: {base} and 98 more like it exist already")
