"""Error messages about keys and values of a YAML file: one sentence with fault and remedy."""

import difflib
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from math import degrees, inf, radians
from typing import Any, get_args

from pydantic import BaseModel

_LONGEST_SHOWN = 60
_MOST_SUGGESTIONS = 3
_MIN_SIMILARITY = 0.5
"""Smallest `_similarity` to an unknown key at which a key of the same section is suggested."""
_MIN_SIMILARITY_ELSEWHERE = 0.75
"""Smallest `_similarity` at which a key of another section is suggested."""

_LARGEST_HINTED = 1e12
"""Beyond it a value has no hint of another unit; it may be too large for a float."""

_NUMBER_AND_UNIT = re.compile(r"([-+]?[0-9]+(?:[.,][0-9]+)?(?:[eE][-+]?[0-9]+)?)\s*(\D*)")

_MISTAKEN_UNITS: tuple[tuple[str, str, Callable[[float], float]], ...] = (
    ("_deg_s2", "rad/s²", degrees),
    ("_deg_s", "rad/s", degrees),
    ("_deg", "rad", degrees),
    ("_rad_s", "°/s", radians),
    ("_ms", "s", lambda value: 1000.0 * value),
    ("_m_s", "km/h", lambda value: value / 3.6),
    ("_per_s", "%", lambda value: 0.01 * value),
    ("_s", "ms", lambda value: 0.001 * value),
    ("_percent", "parts of 1", lambda value: 100.0 * value),
    ("", "%", lambda value: 0.01 * value),
)
"""Suffix of a key, the unit often mistaken for the key's unit, and the conversion from the mistaken
unit to the key's unit. The first suffix that fits is used.
"""
_BOUNDS: dict[str, Callable[[float, float], bool]] = {
    "ge": lambda value, bound: value >= bound,
    "gt": lambda value, bound: value > bound,
    "le": lambda value, bound: value <= bound,
    "lt": lambda value, bound: value < bound,
}


def shortened(value: Any) -> str:
    """A value as shown in an error message."""
    text = repr(value)
    return text if len(text) <= _LONGEST_SHOWN else f"{text[:_LONGEST_SHOWN]}..."


def kinds_in(annotation: Any) -> frozenset[Any]:
    """A type and its type arguments, at any depth, as of unions and annotated types."""
    return _kinds_in(annotation)


@cache  # a function of its own, because mypy does not regard a type as hashable
def _kinds_in(annotation: Any) -> frozenset[Any]:
    return frozenset({annotation}).union(*(kinds_in(part) for part in get_args(annotation)))


def without_consequences(details: list[Any]) -> list[Any]:
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


def mistaken_unit(key: str, value: float) -> tuple[str, float]:
    """The unit often mistaken for the key's unit; the value converted from it to the key's unit."""
    unit, convert = next(
        (unit, convert) for end, unit, convert in _MISTAKEN_UNITS if key.endswith(end)
    )
    return unit, convert(value)


def explained(detail: Any, model: type[BaseModel], former: Mapping[str, str]) -> str:
    """The message about an error that pydantic reports, as one sentence.

    Args:
        detail: the error.
        model: model of the file's top level.
        former: renamed or removed key -> what replaces it.
    """
    location, value = detail["loc"], detail["input"]
    where = ".".join(str(part) for part in location)
    if detail["type"] == "extra_forbidden":
        advice = former.get(where)
        return (
            f"`{where}` {advice}" if advice else f"`{where}` {_unknown_key(location, value, model)}"
        )
    if detail["type"] == "missing" and isinstance(value, list | tuple):
        list_key = ".".join(str(part) for part in location[:-1])
        return f"`{list_key}` has too few values (got {shortened(value)})"
    message = detail["msg"].removeprefix("Value error, ").replace("tuple", "list")
    if not where:
        return str(message)
    if remedy := _remedy(detail, str(location[-1])) or _length_fault(detail):
        return f"`{where}` {remedy}"
    if detail["type"] == "path_type":
        message = "must name a file or a folder"
    got = "" if isinstance(value, dict) else f" (got {shortened(value)})"
    hint = _unit_hint(detail, where)
    if detail["type"] == "literal_error":
        hint = name_hint(value, re.findall(r"'([^']*)'", detail["ctx"]["expected"]))
    return f"`{where}`: {message[:1].lower()}{message[1:]}{got}{hint}"


def name_hint(written: Any, known: Iterable[str]) -> str:
    """The end of a message that refuses a name: which one was probably meant; else empty."""
    near = _nearest(written, known, _MIN_SIMILARITY_ELSEWHERE) if isinstance(written, str) else None
    return f"; did you mean {near}?" if near else ""


def _remedy(detail: Any, key: str) -> str | None:
    """What to write instead of a value of the wrong type; None for other errors."""
    kind, value = detail["type"], detail["input"]
    message = detail["msg"].removeprefix("Value error, ")
    if kind == "value_error" and message.startswith("must be a number") and isinstance(value, str):
        return f"must be a number: {_number_advice(key, value)} (got {shortened(value)})"
    if kind in ("float_parsing", "int_parsing"):
        return f"must be a number: {_number_advice(key, str(value))} (got {shortened(value)})"
    if value is None and kind in ("float_type", "int_type", "string_type", "tuple_type"):
        return "has no value; write one, or take the key out"
    if kind in ("model_type", "dict_type", "model_attributes_type"):
        return (
            "is a section: write its keys on the lines below it, indented by two spaces, each as "
            f"`key: value` (got {shortened(value)})"
        )
    if kind == "tuple_type" and isinstance(value, str | int | float):
        return f"is a list: write `{key}: [{value}]`"
    return None


def _length_fault(detail: Any) -> str | None:
    """How many values a list has and how many it may have; None if the number is not the error."""
    bounds = detail.get("ctx", {})
    if detail["type"] == "too_short":
        return f"has {len(detail['input'])} values; it needs at least {bounds['min_length']}"
    if detail["type"] == "too_long":
        return f"has {len(detail['input'])} values; it takes at most {bounds['max_length']}"
    return None


def _number_advice(key: str, text: str) -> str:
    """What to write instead of a text where a number is needed."""
    match = _NUMBER_AND_UNIT.fullmatch(text.strip())
    if match is None:
        return "write digits, with a point for decimals"
    number, unit = match[1].replace(",", "."), match[2].strip()
    confused_unit, converted = mistaken_unit(key, float(number))
    if unit == confused_unit:
        return f"write {converted:.4g}"
    if unit:
        return f"write {number} without {unit!r}, because the key's name gives the unit"
    if "," in match[1]:
        return f"write {number}, with a point for decimals"
    return f"write {number} without quotation marks"


def _unit_hint(detail: Any, where: str) -> str:
    """A hint if the value is in range once converted from the unit often mistaken for the key's."""
    bound = detail.get("ctx", {})
    value = detail["input"]
    if not isinstance(value, int | float) or not 0.0 < abs(value) < _LARGEST_HINTED:
        return ""
    unit, converted = mistaken_unit(where, value)
    if unit == "%" and (value <= 1.0 or bound.get("le", bound.get("lt", inf)) > 1.0):
        return ""  # only a share of 1 is confused with a percentage
    in_range = [
        satisfies(converted, bound[name]) for name, satisfies in _BOUNDS.items() if name in bound
    ]
    return f"; if it is in {unit}, write {converted:.4g}" if in_range and all(in_range) else ""


def _unknown_key(location: tuple[int | str, ...], value: Any, model: type[BaseModel]) -> str:
    """The message about an unknown key, with the key that was probably meant."""
    name = str(location[-1])
    section, _, key = name.partition(".")
    if len(location) == 1 and ((section,), key) in _keys(model):
        return f"contains a dot; write `{section}: {{{key}: {shortened(value)}}}`"
    section_keys = list(_model_at(location, model).model_fields)
    other_keys = [(key, place) for place, key in _keys(model) if place != location[:-1]]
    if not isinstance(value, dict) and not any(key.startswith(f"{name}_") for key in section_keys):
        same_name = [".".join((*place, key)) for key, place in other_keys if key == name]
        if same_name:
            return f"is in the wrong section; write {_either(same_name)}"
    near = _nearest(name, section_keys, _MIN_SIMILARITY)
    if not isinstance(value, dict):
        far = _nearest(name, [key for key, _ in other_keys], _MIN_SIMILARITY_ELSEWHERE)
        if far and (not near or _similarity(name, far) > _similarity(name, near)):
            places = [".".join((*place, key)) for key, place in other_keys if key == far]
            return f"is not a known key; did you mean {_either(places)}?"
    hint = f"did you mean `{near}`?" if near else f"known here: {', '.join(section_keys)}"
    return f"is not a known key; {hint}"


def dotted_keys(name: str, model: type[BaseModel]) -> str:
    """Up to three dotted keys with this name, joined by "or"; empty if no section has the key."""
    return _either([".".join((*place, key)) for place, key in _keys(model) if key == name])


def _either(places: list[str]) -> str:
    """The first three of some dotted keys, joined by "or"."""
    return " or ".join(f"`{place}`" for place in places[:_MOST_SUGGESTIONS])


def _similarity(written: str, known: str) -> float:
    """Similarity from 0 to 1; nearly 1 if the known key begins or ends with the written one."""
    written = written.lower()
    if known.startswith(f"{written}_"):
        return 0.99
    if known.endswith(f"_{written}"):
        return 0.98
    return difflib.SequenceMatcher(None, written, known).ratio()


def _nearest(name: str, keys: Iterable[str], min_similarity: float) -> str | None:
    similarity = {key: _similarity(name, key) for key in keys}
    best = max(similarity, key=similarity.__getitem__, default=None)
    return best if best is not None and similarity[best] >= min_similarity else None


def _keys(model: type[BaseModel]) -> Iterator[tuple[tuple[str, ...], str]]:
    """The keys in the sections of a file's top level: (path of the section, key)."""
    for section, field in model.model_fields.items():
        for kind in kinds_in(field.annotation):
            if isinstance(kind, type) and issubclass(kind, BaseModel):
                yield from (((section,), key) for key in kind.model_fields)


def _model_at(location: tuple[int | str, ...], model: type[BaseModel]) -> type[BaseModel]:
    """The model of the section that holds the last key of a location."""
    for part in location[:-1]:
        if str(part) not in model.model_fields:
            continue  # a name that the user gave, or a position in a list
        field = model.model_fields[str(part)].annotation
        for kind in (field, *get_args(field)):
            if isinstance(kind, type) and issubclass(kind, BaseModel):
                model = kind
    return model
