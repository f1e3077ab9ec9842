"""Checks numbers from a user's program and converts them to plain floats."""

from collections.abc import Iterable
from math import isfinite

from companion.guidance.reference import Vector


def finite_number(name: str, value: float) -> float:
    """Convert `value` to a finite float; messages call it `name`.

    Raises:
        ValueError: `value` is no number, or not finite.
    """
    try:
        plain = float(value)
    except (TypeError, ValueError, OverflowError):
        plain = float("nan")
    if not isfinite(plain) or isinstance(value, str):
        raise ValueError(f"{name} must be a finite number, not {value!r}")
    return plain


def finite_vector(name: str, value: Iterable[float]) -> Vector:
    """Convert `value` to three finite floats; messages call it `name`.

    Raises:
        ValueError: there are not three values, or a value is not a finite number.
    """
    try:
        x, y, z = (finite_number(name, component) for component in value)
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be three finite numbers, not {value!r}") from None
    return x, y, z
