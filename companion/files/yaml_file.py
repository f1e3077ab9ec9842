"""Reading YAML into a typed model, with errors that say what, where and how to mend it."""

import difflib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, TypeVar, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Field, ValidationError, ValidationInfo, field_validator

from companion.files import bounded_yaml
from companion.files.bounded_file import FileRefusedError, read_text
from companion.files.bounded_yaml import MOST_BYTES, YamlError

Model = TypeVar("Model", bound="Section")

_LONGEST_PATH = 1000
_FAULTS_TOLD = 5
_LONGEST_TOLD = 60

PathKey = Annotated[Path, Field(json_schema_extra={"maxLength": _LONGEST_PATH})]
"""A key that names a file or a folder; `Section` checks its length."""


def is_path(text: str) -> bool:
    """Whether a text can name a file or a folder."""
    return text.strip() != "" and "\0" not in text and len(text) <= _LONGEST_PATH


class Section(BaseModel):
    """A section of the configuration: immutable; unknown keys are refused; every key is described.

    Attributes:
        former_keys: keys that were renamed or removed, dotted, as the file writes them
            (`section.key`) → what became of them, as the end of a sentence that begins with the
            key. Only the table of the file's top level is used.
    """

    former_keys: ClassVar[Mapping[str, str]] = {}

    model_config = ConfigDict(
        extra="forbid", frozen=True, allow_inf_nan=False, use_attribute_docstrings=True
    )

    @field_validator("*", mode="before")
    @classmethod
    def _no_boolean_number(cls, value: Any, field: ValidationInfo) -> Any:
        """Refuse booleans as numbers and words as booleans: pydantic would accept both."""
        wanted = bool in _kinds(cls.model_fields[str(field.field_name)].annotation)
        if isinstance(value, bool) and not wanted:
            raise ValueError("must not be true or false")
        if wanted and not isinstance(value, bool):
            raise ValueError("must be true or false")
        return value

    @field_validator("*", mode="before")
    @classmethod
    def _no_impossible_path(cls, value: Any, field: ValidationInfo) -> Any:
        """Refuse empty paths (they would name the folder itself) and null characters."""
        kinds = _kinds(cls.model_fields[str(field.field_name)].annotation)
        if isinstance(value, str) and Path in kinds and not is_path(value):
            raise ValueError("must name a file or a folder")
        return value


def _kinds(annotation: Any) -> set[Any]:
    """A type and the types inside it, for unions and annotated types."""
    return {annotation}.union(*(_kinds(part) for part in get_args(annotation)))


class ConfigError(Exception):
    """The configuration cannot be used; the message is complete and written for the user."""


class UnreadableFileError(ConfigError):
    """The file is missing or cannot be read."""


def load(path: Path, model: type[Model]) -> Model:
    """Read and check a YAML file.

    Raises:
        ConfigError: the file is missing, not YAML, or holds an unknown key or a bad value.
    """
    return validated(read(path, model), str(path), model)


def read(path: Path, model: type[Section]) -> dict[str, Any]:
    """The keys and values of a YAML file, not yet checked against `model`.

    Raises:
        UnreadableFileError: the file is missing, no regular one, too large, or not UTF-8.
        ConfigError: it is not YAML, or holds no keys.
    """
    try:
        text = read_text(path, MOST_BYTES)
    except FileRefusedError as error:
        raise UnreadableFileError(f"{path}: {error}") from error
    return _keys(text, str(path), model)


def parse(text: str, name: str, model: type[Model]) -> Model:
    """Check YAML text; `name` stands for it in errors.

    Raises:
        ConfigError: as `load`.
    """
    return validated(_keys(text, name, model), name, model)


def _keys(text: str, name: str, model: type[Section]) -> dict[str, Any]:
    try:
        data = bounded_yaml.parse(text)
    except YamlError as error:
        where = name if error.line is None else f"{name}, line {error.line}"
        raise ConfigError(f"{where}: {error}") from error
    if data is None:
        data = {}
    if not isinstance(data, dict):
        first = next(iter(model.model_fields))
        raise ConfigError(f"{name}: expected keys such as `{first}:` at the top level")
    return {key: _filled(key, value, model) for key, value in data.items()}


def _filled(key: Any, value: Any, model: type[Section]) -> Any:
    """The value; an empty section for a section name without keys."""
    field = model.model_fields.get(key)
    if value is not None or field is None:
        return value
    kinds = (field.annotation, *get_args(field.annotation))
    sections = [kind for kind in kinds if isinstance(get_origin(kind) or kind, type)]
    has_keys = any(issubclass(get_origin(kind) or kind, (BaseModel, dict)) for kind in sections)
    return {} if has_keys else None


def validated(
    data: dict[str, Any],
    name: str,
    model: type[Model],
    sources: Mapping[tuple[str, ...], str] | None = None,
) -> Model:
    """Check data already read; `name` stands for it in errors.

    Args:
        data: keys and values.
        name: of the file.
        model: to check against.
        sources: the file of each section or key that stands in another file.

    Raises:
        ConfigError: an unknown key or a bad value.
    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        details = _without_consequences(error.errors(include_url=False))
        faults: dict[str, list[str]] = {}
        for detail in details:
            place = detail["loc"]
            file = (sources or {}).get(place[:2]) or (sources or {}).get(place[:1]) or name
            told = faults.setdefault(file, [])
            told.append(_explain(place, detail, model) if len(told) < _FAULTS_TOLD else "")
        sentences = [f"{file}: " + _joined(lines) for file, lines in faults.items()]
        raise ConfigError("; ".join(sentences)) from error


def _joined(faults: list[str]) -> str:
    """The first faults of a file as one sentence, and how many more there are."""
    more = len(faults) - _FAULTS_TOLD
    return "; ".join(faults[:_FAULTS_TOLD]) + (f"; and {more} more" if more > 0 else "")


def shortened(value: Any) -> str:
    """A value as an error message shows it."""
    text = repr(value)
    return text if len(text) <= _LONGEST_TOLD else f"{text[:_LONGEST_TOLD]}..."


def _without_consequences(details: list[Any]) -> list[Any]:
    """Drop "too short" for a list that is short only because an item was refused."""
    places = [detail["loc"] for detail in details]
    return [
        detail
        for detail in details
        if detail["type"] != "too_short"
        or not any(
            len(p) > len(detail["loc"]) and p[: len(detail["loc"])] == detail["loc"] for p in places
        )
    ]


def _explain(location: tuple[int | str, ...], detail: Any, model: type[Section]) -> str:
    where = ".".join(str(part) for part in location)
    if detail["type"] != "extra_forbidden":
        message = detail["msg"].removeprefix("Value error, ").replace("tuple", "list")
        if not where:
            return str(message)
        value = "" if isinstance(detail["input"], dict) else f" (got {shortened(detail['input'])})"
        return f"`{where}`: {message[:1].lower()}{message[1:]}{value}"
    if where in model.former_keys:
        return f"`{where}` {model.former_keys[where]}"
    known = _keys_beside(location, model)
    near = difflib.get_close_matches(str(location[-1]), known, n=1, cutoff=0.5)
    hint = f"did you mean `{near[0]}`?" if near else f"known here: {', '.join(known)}"
    return f"`{where}` is not a known key; {hint}"


def _keys_beside(location: tuple[int | str, ...], model: type[BaseModel]) -> list[str]:
    for part in location[:-1]:
        field = model.model_fields[str(part)].annotation
        for kind in (field, *get_args(field)):
            if isinstance(kind, type) and issubclass(kind, BaseModel):
                model = kind
    return list(model.model_fields)
