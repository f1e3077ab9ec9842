"""The one place where the units of the YAML keys become SI units."""

from collections.abc import Callable
from math import pi, radians
from typing import Any, Self, overload

MS = 1e-3
DEG = pi / 180.0
_CONVERSIONS: dict[str, Callable[[float], float]] = {
    "_deg": radians,
    "_deg_s": radians,
    "_deg_s2": radians,
    "_ms": lambda value: MS * value,
    "_percent": lambda value: value / 100.0,  # as the vehicle's own percent is converted
}
"""By the end of a key: to rad, rad/s, rad/s², s and a share."""


def scaled(value: float | None, unit: float) -> float | None:
    """A value that may be null, in SI units."""
    return None if value is None else unit * value


class Si(property):
    """A number of a section in SI units, beside the key that the user writes.

    `max_tilt = Si("max_tilt_deg")` is read as `limits.max_tilt`, in rad. It is a property, so that
    pydantic does not take it for a key.
    """

    def __init__(self, key: str) -> None:
        convert = next(each for end, each in _CONVERSIONS.items() if key.endswith(end))
        super().__init__(lambda section: convert(getattr(section, key)))

    @overload
    def __get__(self, section: None, owner: type, /) -> Self: ...
    @overload
    def __get__(self, section: Any, owner: type | None = None, /) -> float: ...
    def __get__(self, section: Any, owner: type | None = None, /) -> Self | float:
        """The number of that section, in rad, rad/s, s or as a share."""
        return self if section is None else float(super().__get__(section, owner))
