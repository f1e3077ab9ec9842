"""Reads YAML into a typed model; an error says what is wrong, where, and how to correct it."""

from collections.abc import Mapping
from os.path import expanduser
from pathlib import Path
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    ClassVar,
    NamedTuple,
    TypeVar,
    get_args,
    get_origin,
)

from pydantic import BaseModel, ConfigDict, Field, ValidationError, ValidationInfo, field_validator

from companion.files import bounded_yaml
from companion.files.bounded_file import FileRefusedError, read_text
from companion.files.bounded_yaml import MOST_BYTES, KeyPath, YamlError
from companion.files.yaml_faults import error_sentence, essential_errors, types_in

Model = TypeVar("Model", bound="Section")

_LONGEST_PATH = 1000
_MOST_FAULTS_SHOWN = 5

PathKey = Annotated[Path, Field(json_schema_extra={"maxLength": _LONGEST_PATH})]
"""A key that names a file or a folder; `Section` checks its length."""


def is_path(text: str) -> bool:
    """Whether a text can name a file or a folder."""
    return text.strip() != "" and "\0" not in text and len(text) <= _LONGEST_PATH


def expanded_path(path: str) -> str:
    """A path with a leading `~` replaced by the home folder; in a file no shell expands it."""
    return expanduser(path)  # noqa: PTH111  Path.expanduser raises for an unknown user


class Section(BaseModel):
    """A section of the configuration: immutable; unknown keys are refused; every key is described.

    Attributes:
        former_keys: renamed or removed key (`section.key`) -> predicate of the error message, such
            as "is now called `flight.maneuvers`". Only the top-level model may define this table.
    """

    former_keys: ClassVar[Mapping[str, str]] = {}

    model_config = ConfigDict(
        extra="forbid", frozen=True, allow_inf_nan=False, use_attribute_docstrings=True
    )

    if not TYPE_CHECKING:  # so that a type checker sees the keys as arguments

        def __init__(self, /, **keys: Any) -> None:
            """Make a section in a program; the keys are checked like those of a file.

            Raises:
                ConfigError: an unknown key or a bad value.
            """
            try:
                self.__pydantic_validator__.validate_python(keys, self_instance=self)
            except ValidationError as error:
                raise _config_error(error, type(self).__name__, type(self), {}) from error

        # Pydantic then validates inner sections without this method, and collects their errors.
        __init__.__pydantic_base_init__ = True

    @field_validator("*", mode="before")
    @classmethod
    def _refuse_conversion(cls, value: Any, field: ValidationInfo) -> Any:
        """Refuse what pydantic would convert: "20" or true as a number, "yes" as a boolean.

        Paths that name nothing, are too long, or hold a null character are refused, too; `~` in a
        path is expanded.
        """
        annotations = types_in(cls.model_fields[str(field.field_name)].annotation)
        if bool in annotations and not isinstance(value, bool):
            raise ValueError("must be true or false")
        if isinstance(value, bool) and bool not in annotations:
            raise ValueError("must not be true or false")
        if not isinstance(value, str):
            return value
        if annotations & {int, float} and not annotations & {str, Path}:
            raise ValueError("must be a number")
        if Path in annotations and not is_path(value):
            raise ValueError("must name a file or a folder")
        return expanded_path(value) if Path in annotations else value


class ConfigError(Exception):
    """The configuration cannot be used; the message is complete and written for the user."""


class UnreadableFileError(ConfigError):
    """The file is missing or cannot be read."""


class SourceLocation(NamedTuple):
    """Where a key stands: file and line."""

    file: str
    line: int | None = None
    """Line number, from 1; None: unknown."""

    def __str__(self) -> str:
        return self.file if self.line is None else f"{self.file}, line {self.line}"


class Contents(NamedTuple):
    """A YAML file that was read but not yet checked against a model."""

    keys: dict[str, Any]
    places: dict[KeyPath, SourceLocation]
    """Where each key and each item of a list stands."""


def load(path: Path, model: type[Model]) -> Model:
    """Read and check a YAML file.

    Raises:
        ConfigError: the file is missing, not YAML, or holds an unknown key or a bad value.
    """
    contents = read(path, model)
    return validated(contents.keys, str(path), model, contents.places)


def read(path: Path, model: type[Section]) -> Contents:
    """Read a YAML file without checking the values; `model` says which keys are sections.

    Raises:
        UnreadableFileError: the file is missing, not regular, too large, or not UTF-8.
        ConfigError: the file is not YAML, or its top level is not a mapping.
    """
    try:
        text = read_text(path, MOST_BYTES)
    except FileRefusedError as error:
        raise UnreadableFileError(f"{path}: {error}") from error
    return _contents(text, str(path), model)


def parse(text: str, name: str, model: type[Model]) -> Model:
    """Parse and check YAML text; error messages call the text `name`.

    Raises:
        ConfigError: see `load`.
    """
    contents = _contents(text, name, model)
    return validated(contents.keys, name, model, contents.places)


def _contents(text: str, name: str, model: type[Section]) -> Contents:
    try:
        data, lines = bounded_yaml.read(text)
    except YamlError as error:
        raise ConfigError(f"{SourceLocation(name, error.line)}: {error}") from error
    if data is None:
        data = {}
    if not isinstance(data, dict):
        first_key = next(iter(model.model_fields))
        raise ConfigError(f"{name}: expected keys such as `{first_key}:` at the top level")
    keys = {key: _value_or_section(key, value, model) for key, value in data.items()}
    return Contents(keys, {where: SourceLocation(name, line) for where, line in lines.items()})


def _value_or_section(key: Any, value: Any, model: type[Section]) -> Any:
    """The value; an empty section if the key is a section without contents."""
    field = model.model_fields.get(key)
    if value is not None or field is None:
        return value
    annotations = (field.annotation, *get_args(field.annotation))
    section_types = [kind for kind in annotations if isinstance(get_origin(kind) or kind, type)]
    has_keys = any(
        issubclass(get_origin(kind) or kind, (BaseModel, dict)) for kind in section_types
    )
    return {} if has_keys else None


def validated(
    data: dict[str, Any],
    name: str,
    model: type[Model],
    places: Mapping[KeyPath, SourceLocation] | None = None,
) -> Model:
    """Check data that was already read; errors begin with file and line of the key, or `name`.

    Raises:
        ConfigError: an unknown key or a bad value.
    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise _config_error(error, name, model, places or {}) from error


def _config_error(
    error: ValidationError,
    name: str,
    model: type[Section],
    places: Mapping[KeyPath, SourceLocation],
) -> ConfigError:
    """The `ConfigError` for a pydantic error: up to five faults with file and line."""
    details = essential_errors(error.errors(include_url=False))
    faults, previous_place = [], SourceLocation("")
    for detail in details[:_MOST_FAULTS_SHOWN]:
        place = nearest_place(detail["loc"], places, name)
        where = f"{place}: "
        if place == previous_place:
            where = ""
        elif place.file == previous_place.file and place.line:
            where = f"line {place.line}: "
        faults.append(where + error_sentence(detail, model, model.former_keys))
        previous_place = place
    hidden_count = len(details) - _MOST_FAULTS_SHOWN
    return ConfigError(
        "; ".join(faults) + (f"; and {hidden_count} more" if hidden_count > 0 else "")
    )


def nearest_place(
    key_path: KeyPath, places: Mapping[KeyPath, SourceLocation], name: str
) -> SourceLocation:
    """File and line of a key, or of the innermost section or list around the key with known line.

    If no line is known, the file `name` without a line.
    """
    prefix_lengths = range(len(key_path), 0, -1)
    return next(
        (places[key_path[:end]] for end in prefix_lengths if key_path[:end] in places),
        SourceLocation(name),
    )
