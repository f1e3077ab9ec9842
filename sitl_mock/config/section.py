"""Base class and number types of every configuration section, and its error messages."""

import difflib
import re
import typing
from collections.abc import Iterable, Mapping
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Fraction = Annotated[float, Field(ge=0.0, le=1.0)]
_MAX_NAMES_LISTED = 20
"""Largest number of known names that a message lists."""
_REQUIREMENTS = {
    "greater_than_equal": "must be at least {ge:.12g}",
    "greater_than": "must be more than {gt:.12g}",
    "less_than_equal": "must be at most {le:.12g}",
    "less_than": "must be less than {lt:.12g}",
    "finite_number": "must be a finite number",
    "float_type": "must be a number",
    "int_type": "must be a whole number",
    "int_from_float": "must be a whole number",
    "bool_type": "must be true or false",
    "bool_parsing": "must be true or false",
    "string_type": "must be a text",
    "path_type": "must name a file",
    "tuple_type": "must be a list",
    "too_long": "has {actual_length} values and takes at most {max_length}",
    "too_short": "has {actual_length} values and needs at least {min_length}",
    "extra_forbidden": "is not a known key",
    "dict_type": "must be a mapping of keys to values",
    "model_type": "must be a mapping of keys to values",
    "model_attributes_type": "must be a mapping of keys to values",
}
"""What a value must be, by the type of pydantic's error; ``{...}`` is filled in from the error."""
_NUMBER_AND_UNIT = re.compile(r"([-+]?[0-9]+(?:[.,][0-9]+)?)\s*(\D*)")


class Section(BaseModel):
    """Base of every configuration section: unknown keys are errors, values cannot be changed."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def resolve_preset(presets: Mapping[str, object], value: object, plural: str) -> object:
    """Return the preset that a text names; return any other value unchanged.

    Raises:
        ValueError: no preset has this name. ``plural`` is the kind of presets, such as "airframes".
    """
    if not isinstance(value, str):
        return value
    if value not in presets:
        raise ValueError(f"known {plural} are {', '.join(presets)}")
    return presets[value]


class ConfigError(Exception):
    """The configuration cannot be used; the message is one sentence for the user."""


def suggestion(word: str, known_names: Iterable[str]) -> str:
    """Return ``; did you mean ...?`` with the known name that is most like ``word``.

    If none is similar: ``; known are ...`` with all names; with more than 20 names, no text.
    """
    names = list(known_names)
    nearest = _nearest(word, names)
    if nearest:
        return f"; did you mean {nearest}?"
    return f"; known are {', '.join(sorted(names))}" if len(names) <= _MAX_NAMES_LISTED else ""


def _nearest(word: str, names: list[str]) -> str | None:
    """Return the name that is most like a mistyped word; None if none is similar enough."""
    nearest = difflib.get_close_matches(word, names, n=1, cutoff=0.5)
    return nearest[0] if nearest else None


def explain(error: ValidationError, model: type[BaseModel]) -> str:
    """Return the first validation error as one sentence: the key, and what is wrong with it."""
    detail = error.errors()[0]
    path = [str(part) for part in detail["loc"]]
    full_key = ".".join(["mock", *path])
    if detail["type"] == "extra_forbidden":
        section_model = _model_at(model, path[:-1])
        sibling_keys = section_model.model_fields if section_model else ()
        other_paths = [other for other in _valid_paths(path[-1], model) if other != full_key]
        if other_paths and not any(key.startswith(f"{path[-1]}_") for key in sibling_keys):
            return f"{full_key} is in the wrong section; write {' or '.join(other_paths)}"
        hint = suggestion(path[-1], sibling_keys) if section_model else ""
        return f"unknown key {full_key}{hint}"
    if detail["type"] in ("float_parsing", "int_parsing"):
        return f"{full_key} must be a number: {_number_advice(str(detail['input']))}"
    if member_error := describe_wrong_kind(detail, model):
        return f"{full_key}{member_error}"
    return f"{full_key}{describe_wrong_value(error)} (got {detail['input']!r:.60})"


def describe_wrong_value(error: ValidationError) -> str:
    """Return what is wrong with the first wrong value, to be put after the path of its key."""
    details = error.errors()
    error_type, path, limits = details[0]["type"], details[0]["loc"], details[0].get("ctx", {})
    if error_type == "missing" and isinstance(details[0]["input"], list | tuple):
        count = len(details[0]["input"])
        missing_values = [each for each in details if each["loc"][:-1] == path[:-1]]
        return f" is missing: the list has {count} values and needs {count + len(missing_values)}"
    if error_type == "missing":
        return " is missing"
    if error_type == "literal_error":
        return f" must be {limits['expected'].replace(chr(39), '')}"
    if error_type in _REQUIREMENTS:
        return f" {_REQUIREMENTS[error_type].format(**limits)}"
    message = details[0]["msg"].removeprefix("Value error, ")
    if message[1:2].islower():
        message = message[0].lower() + message[1:]
    return f": {message}"


def describe_wrong_kind(detail: Any, annotation: Any) -> str:
    """Return what is wrong with a value that has a ``kind``, such as a fault.

    The value may be no mapping, or its ``kind`` may be missing or unknown; for other errors the
    text is empty. ``annotation`` is the union of the possible models, or a section with such a key.
    """
    if detail["type"] == "model_attributes_type":
        return f" must be a mapping of keys to values (got {detail['input']!r:.60})"
    if detail["type"] not in ("union_tag_invalid", "union_tag_not_found"):
        return ""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        annotation = annotation.model_fields[detail["loc"][0]].annotation
    kinds = [kind for model in _models_of(annotation) for kind in _kinds(model)]
    known_kinds = f"kinds are {', '.join(kinds)}"
    if detail["type"] == "union_tag_not_found":
        return f" needs a kind; {known_kinds}"
    unknown_kind = detail["ctx"]["tag"]
    nearest = _nearest(unknown_kind, kinds)
    hint = f"did you mean {nearest}?; " if nearest else ""
    return f": there is no kind {unknown_kind!r:.40}; {hint}{known_kinds}"


def error_path(error: ValidationError) -> list[str]:
    """Return the keys that lead to the first error, beginning with the section ``mock``."""
    return ["mock", *(str(part) for part in error.errors()[0]["loc"])]


def _number_advice(text: str) -> str:
    """Return advice for a text in place of a number: drop the unit, or write digits."""
    match = _NUMBER_AND_UNIT.fullmatch(text.strip())
    if match is None:
        return f"write digits, not {text!r:.60}"
    number, unit = match[1].replace(",", "."), match[2].strip()
    without_unit = f" without {unit!r:.20}" if unit else ""
    return f"write {number}{without_unit} (got {text!r:.60})"


def _valid_paths(key: str, model: type[BaseModel]) -> list[str]:
    """Return the paths at which a key is valid: at the top of ``mock``, or in its sections."""
    paths = [f"mock.{key}"] if key in model.model_fields else []
    for section, field in model.model_fields.items():
        sections = [
            each for each in _models_of(field.annotation) if "kind" not in each.model_fields
        ]
        if any(key in each.model_fields for each in sections):
            paths.append(f"mock.{section}.{key}")
    return paths


def _model_at(model: type[BaseModel], path: list[str]) -> type[BaseModel] | None:
    """Return the model at a path of keys, None if there is none or more than one.

    Positions in lists are skipped. In a union, the path names the member's ``kind``.
    """
    candidates = [model]
    for key in path:
        models_of_kind = [each for each in candidates if key in _kinds(each)]
        if models_of_kind:
            candidates = models_of_kind
        elif len(candidates) == 1 and key in candidates[0].model_fields:
            candidates = list(_models_of(candidates[0].model_fields[key].annotation))
    return candidates[0] if len(candidates) == 1 else None


def _kinds(model: type[BaseModel]) -> tuple[str, ...]:
    field = model.model_fields.get("kind")
    return typing.get_args(field.annotation) if field else ()


def _models_of(annotation: Any) -> Iterable[type[BaseModel]]:
    """Yield the models named in a type hint."""
    arguments = typing.get_args(annotation)
    if arguments:
        for argument in arguments:
            yield from _models_of(argument)
    elif isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
