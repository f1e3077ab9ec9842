"""The keys that may change in flight; each one is marked in its section."""

from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any, NamedTuple

from pydantic import BaseModel

from companion.config.files import changed
from companion.config.markers import IN_FLIGHT, UP_TO_START
from companion.config.reference import sections
from companion.config.root import Config
from companion.files.yaml_file import ConfigError

Values = Mapping[str, Mapping[str, Any]]
"""New values: {section: {key: value}}, as in a configuration file."""


class Difference(NamedTuple):
    """A key with its value before and after a change."""

    section: str
    key: str
    before: Any
    after: Any

    @property
    def name(self) -> str:
        """Section and key, joined by a dot."""
        return f"{self.section}.{self.key}".rstrip(".")

    def __str__(self) -> str:
        return f"{self.name} from {value_text(self.before)} to {value_text(self.after)}"


def value_text(value: Any) -> str:
    """A value as YAML writes it, numbers without trailing zeros."""
    return "null" if value is None else f"{value:g}" if isinstance(value, float) else str(value)


@cache
def changeable_keys() -> dict[tuple[str, str], str]:
    """The keys that may change in flight: (section, key) -> permitted change, in words."""
    return {
        (section, key): str(extra[IN_FLIGHT])
        for section, model in sections().items()
        for key, field in model.model_fields.items()
        if isinstance(extra := field.json_schema_extra, dict) and IN_FLIGHT in extra
    }


def differences(before: Config, after: Config) -> Iterator[Difference]:
    """The keys with different values; `mock` and `include` count as one key each."""
    for section in Config.model_fields:
        old_section, new_section = getattr(before, section), getattr(after, section)
        if not (isinstance(old_section, BaseModel) and isinstance(new_section, BaseModel)):
            if old_section != new_section:
                yield Difference(section, "", old_section, new_section)
            continue
        for key in type(old_section).model_fields:
            if getattr(old_section, key) != getattr(new_section, key):
                yield Difference(section, key, getattr(old_section, key), getattr(new_section, key))


def changed_in_flight(
    start_config: Config, present_config: Config, values: Values, name: str
) -> Config:
    """The present configuration with new values.

    The new values are checked against `start_config`, the configuration at the start of the flight.
    Error messages begin with `name`, the source of the new values.

    Raises:
        ConfigError: a key must not change in flight, or the result is not valid.
    """
    for section, keys in values.items():
        for key in keys:
            full_name, model = f"{section}.{key}".rstrip("."), sections().get(section)
            is_known = (
                section in Config.model_fields if model is None else key in model.model_fields
            )
            if not is_known:
                raise ConfigError(f"{name}: there is no key `{full_name}`")
            if (section, key) not in changeable_keys():
                raise ConfigError(
                    f"{name}: {full_name} cannot be changed in flight; "
                    "a change applies from the next flight on"
                )
    new_config = changed(present_config, values, name)
    for section, keys in values.items():
        for key in keys:
            start_value, new_value = (
                getattr(getattr(config, section), key) for config in (start_config, new_config)
            )
            if changeable_keys()[section, key] == UP_TO_START and new_value > start_value:
                raise ConfigError(
                    f"{name}: {section}.{key} {new_value:g} is more than {start_value:g}, the "
                    "value checked before take-off; in flight you may lower it, and raise it back "
                    "to that value"
                )
    return new_config
