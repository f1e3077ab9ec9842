"""Reading the configuration from YAML, with errors that say what, where and how to mend it."""

import difflib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml
from pydantic import BaseModel, ValidationError

from companion.config import Config


class _UniqueKeys(yaml.SafeLoader):
    """YAML in which a key stands once; plain YAML takes the last one in silence."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        keys = [self.construct_object(key, deep=True) for key, _ in node.value]
        for (key_node, _), key in zip(node.value, keys, strict=True):
            if keys.count(key) > 1:
                raise yaml.constructor.ConstructorError(
                    problem=f"the key {key!r} stands there twice", problem_mark=key_node.start_mark
                )
        return super().construct_mapping(node, deep)


class ConfigError(Exception):
    """The configuration cannot be used; the message is complete and meant for the user."""


def load(path: Path) -> Config:
    """Read and check a configuration file.

    Raises:
        ConfigError: the file is missing, not YAML, or holds an unknown key or a bad value.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"{path}: cannot read the configuration: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path}: not a text file in UTF-8") from error
    return parse(text, str(path))


def parse(text: str, name: str) -> Config:
    """Check a configuration given as YAML text; `name` stands for it in errors.

    Raises:
        ConfigError: as `load`.
    """
    try:
        data = yaml.load(text, _UniqueKeys)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f"{name}, line {mark.line + 1}" if mark else name
        raise ConfigError(f"{where}: not valid YAML: {getattr(error, 'problem', error)}") from error
    if data is None:
        data = {}
    if not isinstance(data, dict):
        raise ConfigError(f"{name}: expected sections such as `link:` at the top level")
    data = {key: ({} if value is None else value) for key, value in data.items()}
    return _validated(data, name)


def _validated(data: dict[str, Any], name: str) -> Config:
    try:
        return Config.model_validate(data)
    except ValidationError as error:
        lines = [_explain(detail["loc"], detail) for detail in error.errors()]
        raise ConfigError(f"{name}: " + "; ".join(lines)) from error


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
    return _validated(data, name)


def json_schema() -> str:
    """JSON Schema of the file, for editors to complete and check while typing."""
    return json.dumps(Config.model_json_schema(), indent=2, ensure_ascii=False) + "\n"


def _explain(location: tuple[int | str, ...], detail: Any) -> str:
    where = ".".join(str(part) for part in location)
    if detail["type"] != "extra_forbidden":
        message = detail["msg"].removeprefix("Value error, ")
        if not where:
            return str(message)
        value = "" if isinstance(detail["input"], dict) else f" (got {detail['input']!r})"
        return f"`{where}`: {message[:1].lower()}{message[1:]}{value}"
    known = _keys_beside(location)
    near = difflib.get_close_matches(str(location[-1]), known, n=1, cutoff=0.5)
    hint = f"did you mean `{near[0]}`?" if near else f"known here: {', '.join(known)}"
    return f"`{where}` is not a known key; {hint}"


def _keys_beside(location: tuple[int | str, ...]) -> list[str]:
    model: type[BaseModel] = Config
    for part in location[:-1]:
        field = model.model_fields[str(part)].annotation
        if isinstance(field, type) and issubclass(field, BaseModel):
            model = field
    return list(model.model_fields)
