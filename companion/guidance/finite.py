"""Numbers that a program gives, as plain finite numbers of their own."""

from collections.abc import Iterable
from math import isfinite

from companion.guidance.reference import Vector


def finite_number(name: str, value: float) -> float:
    """A finite number; `name` is the argument in messages.

    Raises:
        ValueError: it is no number, or not finite.
    """
    try:
        plain = float(value)
    except (TypeError, ValueError, OverflowError):
        plain = float("nan")
    if not isfinite(plain) or isinstance(value, str):
        raise ValueError(f"{name} must be a finite number, not {value!r}")
    return plain


def finite_vector(name: str, value: Iterable[float]) -> Vector:
    """Three finite numbers; `name` is the argument in messages.

    Raises:
        ValueError: there are not three, one is no number, or one is not finite.
    """
    try:
        x, y, z = (finite_number(name, component) for component in value)
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be three finite numbers, not {value!r}") from None
    return x, y, z
