"""Error messages about one value of a YAML file: what it must be, and what to write instead."""

import operator
import re
from collections.abc import Callable, Mapping
from math import degrees, inf, radians
from typing import Any

from companion.files.similar_names import name_hint

_LONGEST_SHOWN_TEXT = 60
_LARGEST_HINTED_VALUE = 1e12
"""Larger values get no hint of a mistaken unit; they may be too large for a float."""

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
    ("_percent", "0..1", lambda value: 100.0 * value),
    ("", "%", lambda value: 0.01 * value),
)
"""Suffix of a key, the unit often mistaken for the key's unit, and the conversion from the mistaken
unit to the key's unit. The first suffix that fits is used.
"""
_BOUNDS: dict[str, Callable[[float, float], bool]] = {
    "ge": operator.ge,
    "gt": operator.gt,
    "le": operator.le,
    "lt": operator.lt,
}
_REQUIREMENTS: Mapping[str, str] = {
    "greater_than_equal": "must be at least {ge:.12g}",
    "greater_than": "must be more than {gt:.12g}",
    "less_than_equal": "must be at most {le:.12g}",
    "less_than": "must be less than {lt:.12g}",
    "finite_number": "must be a finite number",
    "float_type": "must be a number",
    "int_type": "must be a whole number",
    "int_from_float": "must be a whole number",
    "string_type": "must be a text",
    "string_too_short": "must not be empty",
    "string_too_long": "must have at most {max_length} characters",
    "string_pattern_mismatch": "must have the form {pattern}",
    "tuple_type": "must be a list",
    "path_type": "must name a file or a folder",
}
"""What a value must be, by the type of pydantic's error; `{…}` is filled in from the error."""


def shortened_text(value: Any) -> str:
    """A value as shown in an error message."""
    text = repr(value)
    return text if len(text) <= _LONGEST_SHOWN_TEXT else f"{text[:_LONGEST_SHOWN_TEXT]}..."


def mistaken_unit(key: str, value: float) -> tuple[str, float]:
    """The unit often mistaken for the key's unit; the value converted from it to the key's unit."""
    unit, convert = next(
        (unit, convert) for suffix, unit, convert in _MISTAKEN_UNITS if key.endswith(suffix)
    )
    return unit, convert(value)


def value_fault(error: Any, key: str | int) -> str:
    """What is wrong with a value, as the end of a sentence that begins with its key.

    `error` is pydantic's error about the value, not about its key. `key` is the last key that
    leads to the value, or its place in a list.
    """
    if remedy := _remedy(error, key):
        return remedy
    error_type, value, limits = error["type"], error["input"], error.get("ctx", {})
    got_text = f" (got {'a section' if isinstance(value, dict) else shortened_text(value)})"
    if error_type == "value_error":  # from one of our validators, whose message says what must be
        got_text = "" if isinstance(value, dict) else got_text
        return f": {_validator_message(error)}{got_text}"
    if error_type == "literal_error":
        choices = re.findall(r"'([^']*)'", limits["expected"])
        return f" must be {_alternatives(choices)}{got_text}{name_hint(value, choices)}"
    requirement = _REQUIREMENTS.get(error_type, "has a value that cannot be used here").format(
        **limits
    )
    return f" {requirement}{got_text}{_unit_hint(error, str(key))}"


def _validator_message(error: Any) -> str:
    """The message of one of our validators, with a small first letter."""
    message: str = error["msg"].removeprefix("Value error, ")
    return f"{message[:1].lower()}{message[1:]}"


def _alternatives(choices: list[str]) -> str:
    *first_choices, last_choice = choices
    return f"{', '.join(first_choices)} or {last_choice}" if first_choices else last_choice


def _remedy(error: Any, key: str | int) -> str:
    """What to write instead of a value of the wrong type; empty if that is not known."""
    error_type, value = error["type"], error["input"]
    must_be_number = error_type == "value_error" and _validator_message(error).startswith(
        "must be a number"
    )
    if error_type in ("float_parsing", "int_parsing") or (
        must_be_number and isinstance(value, str)
    ):
        text = value if isinstance(value, str) else str(value)
        return f" must be a number: {_number_advice(str(key), text)} (got {shortened_text(value)})"
    if value is None and error_type in ("float_type", "int_type", "string_type", "tuple_type"):
        return " has no value; write one, or take the key out"
    if error_type in ("model_type", "dict_type", "model_attributes_type"):
        return (
            " is a section: write its keys on the lines below it, indented by two spaces, each as "
            f"`key: value` (got {shortened_text(value)})"
        )
    is_single_value = error_type == "tuple_type" and isinstance(value, str | int | float)
    if not is_single_value or len(str(value)) > _LONGEST_SHOWN_TEXT:
        return ""
    return f" is a list: write `[{value}]`"


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


def _unit_hint(error: Any, key: str) -> str:
    """A hint if the value is in range when it is taken as radians for degrees, or the like."""
    limits = error.get("ctx", {})
    value = error["input"]
    if not isinstance(value, int | float) or not 0.0 < abs(value) < _LARGEST_HINTED_VALUE:
        return ""
    unit, converted = mistaken_unit(key, value)
    if unit == "%" and (value <= 1.0 or limits.get("le", limits.get("lt", inf)) > 1.0):
        return ""  # only a share of 1 is confused with a percentage
    bounds_met = [
        satisfies(converted, limits[name]) for name, satisfies in _BOUNDS.items() if name in limits
    ]
    return f"; if it is in {unit}, write {converted:.4g}" if bounds_met and all(bounds_met) else ""
