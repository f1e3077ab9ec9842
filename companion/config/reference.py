"""The reference of the configuration: every key with its default, unit, range and meaning.

All text comes from the sections themselves, so that a key is described in one place.
"""

import textwrap
from collections.abc import Iterable, Iterator
from functools import cache
from itertools import groupby
from typing import Any, NamedTuple

from pydantic import BaseModel

from companion.config import Config
from companion.config.markers import IN_FLIGHT
from companion.config.units import unit_of
from companion.files.bounded_yaml import dump_value

_BOUNDS = (
    ("minimum", "at least {:g}"),
    ("exclusiveMinimum", "more than {:g}"),
    ("maximum", "at most {:g}"),
    ("exclusiveMaximum", "less than {:g}"),
)
_LINE_WIDTH = 98


class ConfigKey(NamedTuple):
    """One key of a section."""

    section: str
    name: str
    value: Any
    """Value of the key, as plain data that YAML can hold."""
    default: Any
    """Default of the key, as plain data that YAML can hold."""
    unit: str
    """Unit such as °/s; empty without a unit."""
    allowed_values: str
    """Range or choices, in words; empty if the type allows any value."""
    meaning: str
    """What the key means."""


def sections() -> dict[str, type[BaseModel]]:
    """The sections of the file, in the file's order."""
    types = {name: field.annotation for name, field in Config.model_fields.items()}
    return {
        name: type_
        for name, type_ in types.items()
        if isinstance(type_, type) and issubclass(type_, BaseModel)
    }


def keys(config: Config) -> Iterator[ConfigKey]:
    """Every key, with its value in a configuration."""
    values, defaults = config.model_dump(mode="json"), Config().model_dump(mode="json")
    for section, descriptions in _descriptions().items():
        for name, text in descriptions.items():
            yield ConfigKey(section, name, values[section][name], defaults[section][name], *text)


@cache
def _descriptions() -> dict[str, dict[str, tuple[str, str, str]]]:
    """Unit, range and meaning of every key, by section and name."""
    descriptions: dict[str, dict[str, tuple[str, str, str]]] = {}
    for section, model in sections().items():
        schema = model.model_json_schema()["properties"]
        descriptions[section] = {
            name: (unit_of(name), _allowed_values(schema[name]), _one_line(field.description or ""))
            for name, field in model.model_fields.items()
        }
    return descriptions


def changed_keys(config: Config) -> Iterator[ConfigKey]:
    """The keys whose values are not the default."""
    return (key for key in keys(config) if key.value != key.default)


def as_yaml(config_keys: Iterable[ConfigKey]) -> str:
    """Keys as commented YAML that is a valid configuration."""
    models, lines = sections(), list[str]()
    for section, section_keys in groupby(config_keys, lambda key: key.section):
        lines += ["", *_comment(models[section].__doc__ or "", ""), f"{section}:"]
        for key in section_keys:
            lines += _comment(key.meaning, "  ")
            note = ", ".join(part for part in (key.unit, key.allowed_values) if part)
            if key.value != key.default:
                note += f"; default: {dump_value(key.default)}"
            note = f"  # {note.removeprefix('; ')}" if note else ""
            lines.append(f"  {key.name}: {dump_value(key.value)}{note}")
    return "\n".join(lines).strip() + "\n"


def as_markdown(config_keys: Iterable[ConfigKey]) -> str:
    """Keys as Markdown tables, one for each section."""
    models, lines = sections(), list[str]()
    for section, section_keys in groupby(config_keys, lambda key: key.section):
        lines += ["", f"## {section}", "", _one_line(models[section].__doc__ or ""), ""]
        lines += ["| key | default | unit | range | meaning |", "|---|---|---|---|---|"]
        for key in section_keys:
            name, default = f"`{key.name}`", f"`{dump_value(key.default)}`"
            cells = name, default, key.unit, key.allowed_values, key.meaning
            lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(lines).strip() + "\n"


def _allowed_values(schema: dict[str, Any]) -> str:
    """Range or choices of a key, from its JSON Schema."""
    options = [schema, *schema.get("anyOf", [])]
    range_texts = []
    for option in options:
        if "enum" in option:
            range_texts.append(" or ".join(str(choice) for choice in option["enum"]))
        range_texts += [text.format(option[bound]) for bound, text in _BOUNDS if bound in option]
        if option.get("type") == "null":
            range_texts.append("or null")
    if IN_FLIGHT in schema:
        range_texts.append(f"changeable in flight {schema[IN_FLIGHT]}")
    return ", ".join(range_texts)


def _comment(text: str, indent: str) -> list[str]:
    return textwrap.wrap(
        _one_line(text), _LINE_WIDTH, initial_indent=f"{indent}# ", subsequent_indent=f"{indent}# "
    )


def _one_line(text: str) -> str:
    return " ".join(text.split())
