"""Lets the mock vehicle check and complete the section `mock` of a configuration."""

from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from companion.files.yaml_file import ConfigError
from sitl_mock.config.section import explain
from sitl_mock.settings import MockSettings


def mock_with_defaults(section: Mapping[str, Any]) -> dict[str, Any]:
    """The section `mock` with the defaults of its autopilot written out.

    Raises:
        ConfigError: an unknown key or a bad value; the message names the key.
    """
    try:
        return MockSettings.model_validate(dict(section)).model_dump()
    except ValidationError as error:
        raise ConfigError(explain(error, MockSettings)) from error


def mock_with_changes(section: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """The complete section `mock` with some keys changed.

    A change leaves all other keys unchanged: `wind.speed_m_s` keeps the gusts. The two changes
    `airframe: unlike-axes` and `airframe.mass_kg` give the airframe `unlike-axes` another mass.

    Args:
        section: section before the changes.
        changes: new values by dotted key, without `mock.` in front.

    Raises:
        ConfigError: an unknown key or a bad value; the message names the key.
    """
    changes_by_depth: dict[int, dict[str, Any]] = {}
    for key, value in changes.items():
        changes_by_depth.setdefault(key.count("."), {})[key] = value
    changed_section = dict(section) | changes_by_depth.pop(0, {})
    complete_section = mock_with_defaults(changed_section)
    for depth in sorted(changes_by_depth):
        for key, value in changes_by_depth[depth].items():
            _set_nested(complete_section, key.split("."), value)
        complete_section = mock_with_defaults(complete_section)
    return complete_section


def _set_nested(section: dict[str, Any], path: list[str], value: Any) -> None:
    """Set a value in a nested section.

    Raises:
        ConfigError: a name on the path has a value that is not a section.
    """
    for depth, name in enumerate(path[:-1]):
        subsection = section.get(name)
        if name in section and not isinstance(subsection, dict):
            section_key = ".".join(["mock", *path[: depth + 1]])
            raise ConfigError(
                f"mock.{'.'.join(path)} cannot be set: {section_key} is {subsection!r:.40}, "
                "not a section"
            )
        section = section.setdefault(name, {})
    section[path[-1]] = value
