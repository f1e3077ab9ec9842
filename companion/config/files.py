"""Configuration files: reading them with their includes, changing keys, the JSON Schema."""

import json
import sysconfig
from collections.abc import Mapping, Sequence
from contextlib import suppress
from os.path import realpath
from pathlib import Path
from typing import Any

from companion.config import Config
from companion.config.file_kinds import FileKind, require_kind
from companion.config.root import MOST_INCLUDED
from companion.config.trajectory_file import is_table
from companion.files import bounded_yaml, yaml_file
from companion.files.bounded_yaml import KeyPath
from companion.files.similar_names import name_hint
from companion.files.value_faults import shortened_text
from companion.files.yaml_faults import dotted_keys
from companion.files.yaml_file import ConfigError, Contents, UnreadableFileError

_INCLUDE = "include"
FILE_KEYS: tuple[tuple[str, ...], ...] = (
    ("flight", "trajectory"),
    ("link", "signing_key_file"),
    ("mock", "signing", "passphrase_file"),
)
"""Keys that name a file to read. A relative path starts at the folder of the file with the key."""
_MAX_INCLUDE_DEPTH = 4
"""Largest depth of nested includes."""


def load(path: Path | str) -> Config:
    """Read and check a configuration file and the files that it includes.

    Keys of a file override those of its includes; a later include overrides an earlier one.

    Raises:
        ConfigError: a file is missing, includes itself or too many files, is not YAML, or holds an
            unknown key or a bad value.
    """
    path = Path(path)
    if is_table(path):
        raise ConfigError(
            f"{path} is a table of a trajectory, not a configuration; fly it with --trajectory"
        )
    contents = _read(path)
    require_kind(path, contents.keys, FileKind.CONFIG)
    reader = _IncludeReader()
    reader.add((path,), contents)
    merged = reader.merged
    _drop_mixed_identification(merged)
    return yaml_file.validated(merged.keys, str(path), Config, merged.places)


def files_of(path: Path) -> tuple[Path, ...]:
    """A configuration file and the files that it includes, directly or through others.

    Reading stops at the first file that is missing or faulty, which is then the last of the result.
    """
    reader = _IncludeReader()
    with suppress(ConfigError):
        reader.add((path,), _read(path))
    return (path, *reader.files)


def _read(path: Path) -> Contents:
    """Read one file, and resolve its paths against its own folder."""
    contents = yaml_file.read(path, Config)
    for *sections, key in FILE_KEYS:
        values: Any = contents.keys
        for section in sections:
            values = values.get(section) if isinstance(values, dict) else None
        name = values.get(key) if isinstance(values, dict) else None
        if isinstance(name, str) and yaml_file.is_path(name):
            values[key] = str(path.parent / yaml_file.expanded_path(name))
    return contents


def _drop_mixed_identification(merged: Contents) -> None:
    """Drop `vehicle.identified` and `vehicle.autopilot` if keys of `vehicle` come from other files.

    In that case `companion identify` did not measure all keys of `vehicle`.
    """
    identified_place = merged.places.get(("vehicle", "identified"))
    files = {
        place.file
        for key_path, place in merged.places.items()
        if key_path[:1] == ("vehicle",) and len(key_path) > 1
    }
    if identified_place is not None and files != {identified_place.file}:
        merged.keys["vehicle"] |= {"identified": None, "autopilot": None}


class _IncludeReader:
    """Reads the files that a file includes; keys of an including file override the included ones.

    Attributes:
        merged: the keys that were read.
        files: included files that were opened.
    """

    def __init__(self) -> None:
        self.merged = Contents({}, {})
        self.files: list[Path] = []

    def add(self, include_chain: tuple[Path, ...], contents: Contents) -> None:
        """Add the keys of a file, after those of the files that it includes.

        Args:
            include_chain: the including files, the outermost first, and at the end the file itself.
            contents: contents of the file itself.

        Raises:
            ConfigError: see `load`.
        """
        for path in _included_paths(include_chain[-1], contents.keys):
            self.add((*include_chain, path), self._read_included(*include_chain, path))
        _merge(self.merged, contents)

    def _read_included(self, *include_chain: Path) -> Contents:
        *_, including_file, path = include_chain
        self.files.append(path)
        if len(self.files) > MOST_INCLUDED:
            raise ConfigError(f"{include_chain[0]}: more than {MOST_INCLUDED} files are included")
        if realpath(path) in map(realpath, include_chain[:-1]):
            names = " includes ".join(str(each) for each in include_chain)
            raise ConfigError(f"{include_chain[0]}: a file must not include itself: {names}")
        if len(include_chain) - 1 > _MAX_INCLUDE_DEPTH:
            raise ConfigError(
                f"{including_file}: includes may be nested at most {_MAX_INCLUDE_DEPTH} files deep"
            )
        try:
            included_contents = _read(path)
        except UnreadableFileError as error:
            raise ConfigError(f"{error} (included by {including_file})") from error
        _check_included(path, included_contents.keys)
        return included_contents


def _included_paths(path: Path, keys: dict[str, Any]) -> list[Path]:
    file_names = keys.get(_INCLUDE, [])
    file_names = [file_names] if isinstance(file_names, str) else file_names
    if not isinstance(file_names, list) or not all(
        isinstance(name, str) and yaml_file.is_path(name) for name in file_names
    ):
        text = shortened_text(file_names)
        raise ConfigError(f"{path}: `{_INCLUDE}` must be a file or a list of files, not {text}")
    return [path.parent / yaml_file.expanded_path(name) for name in file_names]


def _check_included(path: Path, keys: dict[str, Any]) -> None:
    for section, values in keys.items():
        if section == "mock":
            raise ConfigError(
                f"{path}: `mock` is not allowed in an included file: the mock vehicle reads "
                "only the main file; move the section there (`companion init mock` writes a file "
                "that has one)"
            )
        if section == _INCLUDE:
            continue
        if section in Config.model_fields and not isinstance(values, dict):
            text = shortened_text(values)
            raise ConfigError(f"{path}: `{section}` must hold keys, not {text}")


def _merge(merged: Contents, contents: Contents) -> None:
    """Let the keys of a file override earlier ones, and remember the file of each key."""
    merged_keys = merged.keys
    for section, values in contents.keys.items():
        merged_keys.setdefault(section, {})
        if isinstance(values, dict) and isinstance(merged_keys[section], dict):
            replaced_keys: set[KeyPath] = {(section, key) for key in values}
            merged_keys[section] = {**merged_keys[section], **values}
        else:
            replaced_keys = {key_path for key_path in merged.places if key_path[:1] == (section,)}
            merged_keys[section] = values
        for key_path in [key_path for key_path in merged.places if key_path[:2] in replaced_keys]:
            del merged.places[key_path]
    merged.places.update(contents.places)


def changed(config: Config, changes: Mapping[str, Mapping[str, Any]], name: str) -> Config:
    """The configuration with new values by section and key, checked again.

    Error messages begin with `name`, the source of the new values.

    Raises:
        ConfigError: the result is not valid.
    """
    data = config.model_dump()
    for section, values in changes.items():
        present_section = data.get(section)
        if isinstance(present_section, dict) and isinstance(values, Mapping):
            present_section.update(values)
        elif section == "include":
            raise ConfigError(f"{name}: `include` works only in a YAML file; load such a file")
        else:  # `validated` refuses it, and names the key that was probably meant
            data[section] = values
    return yaml_file.validated(data, name, Config)


def with_assignments(config: Config, assignments: Sequence[str]) -> Config:
    """The configuration changed by texts such as `limits.max_tilt_deg=20`, with values in YAML.

    Raises:
        ConfigError: a text has another form, an unknown section or `mock`, or an invalid value.
    """
    changes: dict[str, dict[str, Any]] = {}
    for text in assignments:
        key, equals_sign, value = text.partition("=")
        section, dot, name = key.strip().partition(".")
        if equals_sign and not dot and (suggested_keys := dotted_keys(section, Config)):
            raise ConfigError(f"--set {text}: name the section, as in {suggested_keys}")
        if not (equals_sign and dot and section and name):
            raise ConfigError(f"--set {text}: write SECTION.KEY=VALUE, as limits.max_tilt_deg=20")
        if section not in Config.model_fields:
            hint = name_hint(section, Config.model_fields)
            raise ConfigError(f"--set {text}: there is no section `{section}`{hint}")
        if section == "mock":
            raise ConfigError(
                f"--set {text}: --set cannot change the section `mock`, because the mock vehicle "
                "reads it from the configuration file; change it there (`companion init mock` "
                "writes a file for --config)"
            )
        try:
            changes.setdefault(section, {})[name] = bounded_yaml.parse(value)
        except bounded_yaml.YamlError as error:
            raise ConfigError(f"--set {text}: {error}") from error
    return changed(config, changes, "--set")


def shipped(name: str) -> Path:
    """Path of a shipped configuration: in the repository, or where pip installed it.

    Raises:
        ConfigError: the file is in neither place.
    """
    repository = Path(__file__).parents[2]
    installed = Path(sysconfig.get_path("data"), "share", "mavlink-companion")
    for folder in (repository, installed):
        path = folder / "configs" / name
        if path.is_file():
            return path
    raise ConfigError(f"{name} is not in {installed}; name a configuration with --config")


def json_schema() -> str:
    """JSON Schema of a configuration file, for editors to complete and check while typing."""
    return json.dumps(Config.model_json_schema(), indent=2, ensure_ascii=False) + "\n"
