"""Dotted keys of the program's and the mock vehicle's configuration, as a campaign sets them."""

from collections.abc import Mapping
from typing import Any

from companion.config import Config
from companion.files.yaml_file import ConfigError, validated
from companion.testing.settings import mock_with_changes, mock_with_defaults

_KEYS_WITHOUT_EFFECT = (
    "flight.arm",
    "link.backend",
    "link.endpoint",
    "link.lockstep",
    "mock.control_port",
    "mock.endpoint",
    "mock.faults",
    "mock.gcs_port",
    "mock.lockstep",
    "mock.port",
    "mock.seed",
    "mock.speed",
    "realtime",
    "recording",
    "serve",
)
"""Keys and sections that a campaign ignores or sets itself."""
_SIGNING_KEYS = ("link.signing_key_file", "mock.signing")


def check_key(key: str, base: Config, place_text: str) -> None:
    """Check that a dotted key exists in `base`, and that a campaign can change it.

    `place_text` is file, line and section of the key, for messages.

    Raises:
        ConfigError: the key is not SECTION.KEY, does not exist, has no effect in a campaign, or
            concerns signing. The message names the key; for an unknown key also the nearest one, if
            any.
    """
    section, dot, name = key.partition(".")
    if not (dot and section and name):
        raise ConfigError(f"{place_text}: `{key}`: write SECTION.KEY, such as limits.max_tilt_deg")
    if any(f"{key}.".startswith(f"{excluded_key}.") for excluded_key in _KEYS_WITHOUT_EFFECT):
        raise ConfigError(
            f"{place_text}: `{key}` has no effect in a campaign, or the campaign sets the key "
            "itself; take it out"
        )
    if any(f"{key}.".startswith(f"{excluded_key}.") for excluded_key in _SIGNING_KEYS):
        raise ConfigError(f"{place_text}: `{key}`: campaigns fly without signing; take it out")
    if section == "mock":
        _check_mock_key(name, base.mock or {}, place_text)
    elif section not in Config.model_fields and section in mock_with_defaults(base.mock or {}):
        raise ConfigError(
            f"{place_text}: there is no section `{section}`; did you mean mock.{key}?"
        )
    elif name not in getattr(type(getattr(base, section, None)), "model_fields", ()):
        # This raises the error that names the nearest key, if there is one.
        validated({section: {name: 0.0}}, place_text, Config)
        raise ConfigError(f"{place_text}: there is no key `{key}`")


def _check_mock_key(name: str, section: Mapping[str, Any], place_text: str) -> None:
    """Check that a key of the mock vehicle exists; its value is checked later, with each case."""
    *subsections, key = name.split(".")
    complete_section: Any = mock_with_defaults(section)
    for subsection in subsections:
        complete_section = (
            complete_section.get(subsection) if isinstance(complete_section, dict) else None
        )
    if isinstance(complete_section, dict) and key in complete_section:
        return
    try:
        mock_with_changes(section, {name: 0.0})
    except ConfigError as error:
        if "unknown" in str(error) or "wrong section" in str(error):
            raise ConfigError(f"{place_text}: {error}") from error


def with_keys(base: Config, changes: Mapping[str, Any]) -> Config:
    """`base` with the new values in `changes`, by dotted key; its section `mock` gets all defaults.

    Raises:
        ConfigError: a value is refused; the message names the key.
    """
    mock_changes: dict[str, Any] = {}
    # Sections without a change are not checked again, which would take most of the time.
    sections = {name: getattr(base, name) for name in Config.model_fields if name != "include"}
    for key, value in changes.items():
        section, _, name = key.partition(".")
        if section == "mock":
            mock_changes[name] = value
            continue
        if not isinstance(sections[section], dict):
            sections[section] = sections[section].model_dump()
        sections[section][name] = value
    config = validated(sections, "the configuration", Config)
    return config.model_copy(update={"mock": mock_with_changes(base.mock or {}, mock_changes)})


def replace_unchecked(config: Config, **sections: dict[str, Any]) -> Config:
    """The configuration with new values by section and key, which are not checked."""
    changed_sections = {
        name: getattr(config, name).model_copy(update=values) for name, values in sections.items()
    }
    return config.model_copy(update=changed_sections)
