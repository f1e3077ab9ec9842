"""A configuration file that a user edits during the flight."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from companion.config import Config
from companion.config.files import files_of, load
from companion.config.in_flight import Values, differences
from companion.files.yaml_file import ConfigError

_LONGEST_REASON = 400
"""Largest length of the reason for refusing an edit, characters."""
_UNCHANGED_CHECKS = 3
"""A file counts as complete after this many checks without a change; editors save in steps."""

FileStamps = tuple[tuple[int, int, int] | None, ...]
"""Inode, size and time of change (ns) of the file and each included file; None: it is missing."""


class Edit(NamedTuple):
    """The changes by an edit of the file, or why the edit is refused.

    Attributes:
        values: the changed values, by section and key.
        refusal: why the edit cannot be used, one sentence; None: the edit can be used.
    """

    values: Values
    refusal: str | None = None


class WatchedFile:
    """Checks a file repeatedly, and finds what an edit changes.

    Each edit is compared with the last accepted contents, so a bad edit never has an effect.

    Args:
        path: path of the file.
        config_as_read: configuration as read from this file for the flight. A change of the file
            since then is the first edit.
        check: called with changed values and the name of the file; raises ConfigError if they
            cannot be used.
    """

    def __init__(
        self, path: Path, config_as_read: Config, check: Callable[[Values, str], None]
    ) -> None:
        self._path, self._check = path, check
        self._accepted_config = self._newest_config = config_as_read
        self._files = files_of(path)
        self._newest_stamps = self._current_stamps()
        self._checked_stamps: FileStamps | None = None
        self._unchanged_checks = 0

    def newest_edit(self) -> Edit | None:
        """The newest edit; None: no new edit, or the file is still being written."""
        stamps = self._current_stamps()
        if stamps != self._newest_stamps:
            self._newest_stamps, self._unchanged_checks = stamps, 0
        self._unchanged_checks += 1
        if self._unchanged_checks < _UNCHANGED_CHECKS or stamps == self._checked_stamps:
            return None
        self._files = files_of(self._path)
        self._newest_stamps = self._checked_stamps = self._current_stamps()
        return self._read_edit()

    def accept(self) -> None:
        """Accept the newest edit: later edits are compared with it."""
        self._accepted_config = self._newest_config

    def _read_edit(self) -> Edit | None:
        name = self._path.name
        try:
            self._newest_config = load(self._path)
            values = _changed_values(self._accepted_config, self._newest_config)
            if not values:
                return None
            self._check(values, name)
        except ConfigError as error:
            text = " ".join(str(error).split())
            text = text if len(text) <= _LONGEST_REASON else f"{text[:_LONGEST_REASON]}…"
            return Edit({}, f"{name} is not applied, and nothing has changed: {text}")
        return Edit(values)

    def _current_stamps(self) -> FileStamps:
        return tuple(map(_file_stamp, self._files))


def _changed_values(before: Config, after: Config) -> dict[str, dict[str, Any]]:
    """The values that an edit changes, by section and key; changes of `include` are left out."""
    values: dict[str, dict[str, Any]] = {}
    for each in differences(before, after):
        if each.section != "include":
            values.setdefault(each.section, {})[each.key] = each.after
    return values


def _file_stamp(path: Path) -> tuple[int, int, int] | None:
    try:
        stat = path.stat()
    except (OSError, ValueError):
        return None
    return stat.st_ino, stat.st_size, stat.st_mtime_ns
