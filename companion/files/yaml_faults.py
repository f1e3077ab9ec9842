"""Error messages about keys and values of a YAML file: one sentence with fault and remedy."""

import re
from collections.abc import Iterator, Mapping
from functools import cache
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel

from companion.files.similar_names import (
    MIN_SIMILARITY,
    MIN_SIMILARITY_IN_OTHER_SECTION,
    most_similar_name,
    similarity,
)
from companion.files.value_faults import shortened_text, value_fault

Location = tuple[int | str, ...]
"""Keys and places in lists that lead to a value, as pydantic gives them."""

_MOST_SUGGESTIONS = 3
_UNION_MEMBER = re.compile(r".*\[.*\]|(constrained-)?(str|int|float|bool)")
"""The part of a location that names a member of a union, and not a key."""


def types_in(annotation: Any) -> frozenset[Any]:
    """A type, and at any depth its type arguments, such as the members of a union."""
    return _types_in(annotation)


@cache  # separate from `types_in`, because mypy does not regard a type as hashable
def _types_in(annotation: Any) -> frozenset[Any]:
    return frozenset({annotation}).union(*(types_in(part) for part in get_args(annotation)))


def essential_errors(errors: list[Any]) -> list[Any]:
    """The errors that a user needs, without those that follow from others.

    The function drops "too short" for a list that is short only because an item was refused,
    further missing items of a list, and the errors of all members of a union but one.
    """
    essential: list[Any] = []
    for error in errors:
        error_type, location = error["type"], error["loc"]
        deeper_locations = [other["loc"] for other in errors if len(other["loc"]) > len(location)]
        if error_type == "too_short" and any(
            each[: len(location)] == location for each in deeper_locations
        ):
            continue
        if _is_missing_item(error) and any(
            _is_missing_item(each) and each["loc"][:-1] == location[:-1] for each in essential
        ):
            continue
        essential.append(error)
    return _one_member(essential)


def _one_member(errors: list[Any]) -> list[Any]:
    """Keep only the errors of one member of each union: the one whose type fits the value."""
    member_by_union: dict[Location, Location] = {}
    for fits_value in (True, False):
        for error in errors:
            location = error["loc"]
            member_index = next((k for k, part in enumerate(location) if _is_member(part)), None)
            if member_index is not None and (len(location) > member_index + 1 or not fits_value):
                member_by_union.setdefault(location[:member_index], location[: member_index + 1])
    return [
        error
        for error in errors
        if all(
            error["loc"][: len(union)] != union or error["loc"][: len(member)] == member
            for union, member in member_by_union.items()
        )
    ]


def _is_member(part: int | str) -> bool:
    return isinstance(part, str) and _UNION_MEMBER.fullmatch(part) is not None


def _is_missing_item(error: Any) -> bool:
    return error["type"] == "missing" and isinstance(error["input"], list | tuple)


def error_sentence(error: Any, model: type[BaseModel], former_keys: Mapping[str, str]) -> str:
    """The message about an error that pydantic reports, as one sentence.

    `former_keys` has, for each renamed or removed key, what replaces it.
    """
    error_type, value = error["type"], error["input"]
    location = tuple(part for part in error["loc"] if not _is_member(part))
    dotted_key = ".".join(str(part) for part in location)
    if error_type == "extra_forbidden":
        replacement = former_keys.get(dotted_key)
        return (
            f"`{dotted_key}` {replacement}"
            if replacement
            else f"`{dotted_key}` {_unknown_key(location, value, model)}"
        )
    if not dotted_key:
        return str(error["msg"]).removeprefix("Value error, ")
    if _is_missing_item(error):
        location = location[:-1]
        dotted_key = ".".join(str(part) for part in location)
    if _is_missing_item(error) or error_type in ("too_short", "too_long"):
        return f"`{dotted_key}` {_length_fault(error, _types_at(location, model))}"
    if error_type == "missing":
        return f"`{dotted_key}` is missing"
    return f"`{dotted_key}`{value_fault(error, location[-1])}"


def _length_fault(error: Any, types: list[Any]) -> str:
    """How many values a list has, and how many it needs; `types`: types that the list may have."""
    value, bounds = error["input"], error.get("ctx", {})
    count = f"has {len(value)} {'value' if len(value) == 1 else 'values'}"
    lengths = [
        len(get_args(kind))
        for kind in types
        if get_origin(kind) is tuple and Ellipsis not in get_args(kind)
    ]
    if lengths:
        return f"{count}; it needs {lengths[0]} (got {shortened_text(value)})"
    if error["type"] == "too_short":
        return f"{count}; it needs at least {bounds['min_length']}"
    return f"{count}; it takes at most {bounds['max_length']}"


def _types_at(location: Location, model: type[BaseModel]) -> list[Any]:
    """The types that the value at a location may have."""
    types: list[Any] = [model]
    for part in location:
        part_types = [_type_inside(kind, part) for kind in types]
        types = [member for each in part_types if each is not None for member in _members(each)]
    return types


def _type_inside(kind: Any, part: int | str) -> Any:
    """Type of the key or item `part` in a section, dictionary or list; None: no such part."""
    arguments = get_args(kind)
    if isinstance(kind, type) and issubclass(kind, BaseModel) and str(part) in kind.model_fields:
        return kind.model_fields[str(part)].annotation
    if get_origin(kind) is dict:
        return arguments[1]
    if get_origin(kind) is not tuple or not isinstance(part, int):
        return None
    if Ellipsis in arguments:
        return arguments[0]
    return arguments[part] if part < len(arguments) else None


def _members(annotation: Any) -> Iterator[Any]:
    """The types of a union, or the one type, without annotations."""
    if get_origin(annotation) is Annotated:
        yield from _members(get_args(annotation)[0])
    elif get_origin(annotation) in (Union, UnionType):
        for each in get_args(annotation):
            yield from _members(each)
    else:
        yield annotation


def _unknown_key(location: Location, value: Any, model: type[BaseModel]) -> str:
    """The message about an unknown key, with the key that was probably meant."""
    name = str(location[-1])
    section, _, key = name.partition(".")
    if len(location) == 1 and ((section,), key) in _keys(model):
        return f"contains a dot; write `{section}: {{{key}: {shortened_text(value)}}}`"
    section_types = _types_at(location[:-1], model)
    section_keys = [key for kind in section_types for key in getattr(kind, "model_fields", ())]
    other_keys = [(key, place) for place, key in _keys(model) if place != location[:-1]]
    if not isinstance(value, dict) and not any(key.startswith(f"{name}_") for key in section_keys):
        same_name_keys = [".".join((*place, key)) for key, place in other_keys if key == name]
        if same_name_keys:
            or_here = [f", or here `{key}`" for key in section_keys if key.endswith(f"_{name}")][:1]
            return (
                f"is in the wrong section; write {_joined_by_or(same_name_keys)}{''.join(or_here)}"
            )
    near_key = most_similar_name(name, section_keys, MIN_SIMILARITY)
    if not isinstance(value, dict):
        far_key = most_similar_name(
            name, [key for key, _ in other_keys], MIN_SIMILARITY_IN_OTHER_SECTION
        )
        if far_key and (not near_key or similarity(name, far_key) > similarity(name, near_key)):
            far_keys = [".".join((*place, key)) for key, place in other_keys if key == far_key]
            return f"is not a known key; did you mean {_joined_by_or(far_keys)}?"
    hint = f"did you mean `{near_key}`?" if near_key else f"known here: {', '.join(section_keys)}"
    return f"is not a known key; {hint}"


def dotted_keys(name: str, model: type[BaseModel]) -> str:
    """Up to three dotted keys with this name, joined by "or"; empty if no section has the key."""
    return _joined_by_or([".".join((*place, key)) for place, key in _keys(model) if key == name])


def _joined_by_or(dotted_keys: list[str]) -> str:
    """The first three of some dotted keys, joined by "or"."""
    return " or ".join(f"`{key}`" for key in dotted_keys[:_MOST_SUGGESTIONS])


def _keys(model: type[BaseModel]) -> Iterator[tuple[tuple[str, ...], str]]:
    """The keys in the sections of a file's top level: (path of the section, key)."""
    for section, field in model.model_fields.items():
        for kind in types_in(field.annotation):
            if isinstance(kind, type) and issubclass(kind, BaseModel):
                yield from (((section,), key) for key in kind.model_fields)
