"""The configuration as files: read with what they include, changed, described for editors."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from companion import yaml_file
from companion.config import Config
from companion.yaml_file import ConfigError

_INCLUDE = "include"
_MAIN_FILE_ONLY = {
    _INCLUDE: "an included file must not include another",
    "mock": "the bundled vehicle reads its section from the main file alone",
}


def load(path: Path) -> Config:
    """Read and check a configuration file, and the files that its `include` names beside it.

    Keys of the file itself win over included ones, those of a later file over an earlier one's.

    Raises:
        ConfigError: a file is missing, not YAML, or holds an unknown key or a bad value.
    """
    own = yaml_file.read(path, Config)
    data: dict[str, Any] = {}
    sources: dict[tuple[str, ...], str] = {}
    for included in _included(path, own):
        part = yaml_file.read(included, Config)
        _check_part(included, part)
        _merge(data, part, sources, str(included))
    _merge(data, own, sources, str(path))
    return yaml_file.validated(data, str(path), Config, sources)


def _included(path: Path, own: dict[str, Any]) -> list[Path]:
    names = own.get(_INCLUDE, [])
    names = [names] if isinstance(names, str) else names
    if not isinstance(names, list) or not all(
        isinstance(name, str) and yaml_file.is_path(name) for name in names
    ):
        raise ConfigError(f"{path}: `{_INCLUDE}` must be a file or a list of files, not {names!r}")
    return [path.parent / name for name in names]


def _check_part(included: Path, part: dict[str, Any]) -> None:
    for section, values in part.items():
        if section in _MAIN_FILE_ONLY:
            reason = _MAIN_FILE_ONLY[section]
            raise ConfigError(f"{included}: `{section}` must not stand here: {reason}")
        if section in Config.model_fields and not isinstance(values, dict):
            raise ConfigError(f"{included}: `{section}` must hold keys, not {values!r}")


def _merge(
    data: dict[str, Any], part: dict[str, Any], sources: dict[tuple[str, ...], str], name: str
) -> None:
    """Put a file's keys over those of earlier ones, and note in which file each stands."""
    for section, values in part.items():
        sources[(section,)] = name
        data.setdefault(section, {})
        if isinstance(values, dict) and isinstance(data[section], dict):
            sources.update({(section, key): name for key in values})
            data[section] = {**data[section], **values}
        else:
            data[section] = values


def changed(config: Config, changes: Mapping[str, Mapping[str, Any]], name: str) -> Config:
    """The configuration with some keys changed, checked anew.

    Args:
        config: to start from.
        changes: new values by section and key.
        name: stands for the changes in errors.

    Raises:
        ConfigError: the result holds together no more.
    """
    data = config.model_dump()
    for section, values in changes.items():
        data[section].update(values)
    return yaml_file.validated(data, name, Config)


def json_schema() -> str:
    """JSON Schema of the file, for editors to complete and check while typing."""
    return json.dumps(Config.model_json_schema(), indent=2, ensure_ascii=False) + "\n"
