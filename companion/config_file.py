"""The configuration as a file: read, changed by the command line, described for editors."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from companion import yaml_file
from companion.config import Config


def load(path: Path) -> Config:
    """Read and check a configuration file.

    Raises:
        ConfigError: the file is missing, not YAML, or holds an unknown key or a bad value.
    """
    return yaml_file.load(path, Config)


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
