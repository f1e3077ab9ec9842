"""Checks that an output file can be written, before the work starts."""

import os
from pathlib import Path

from companion.files.yaml_file import ConfigError


def require_writable(output: Path, option: str, *, force: bool) -> None:
    """Refuse an output file that cannot be written; `option` names it in the message.

    An existing file may be replaced only with `force`.

    Raises:
        ConfigError: the file cannot be written; the message says why.
    """
    folder = output.parent
    if output.is_dir():
        raise ConfigError(f"{output} is a folder; choose a file in it with {option}")
    if output.exists() and not force:
        raise ConfigError(
            f"{output} exists; choose another file with {option}, or replace it with --force"
        )
    if not folder.is_dir():
        raise ConfigError(
            f"{output}: there is no folder {folder}; make it, or choose another file with {option}"
        )
    if not os.access(folder, os.W_OK | os.X_OK):
        raise ConfigError(
            f"{output}: the folder {folder} cannot be written; choose another file with {option}"
        )
