"""The units of YAML keys: their names, and their conversion to SI, which happens only here."""

from collections.abc import Callable
from math import radians
from typing import Any, Self, overload

Conversion = Callable[[float], float]


_UNITS = {
    "_deg_s2": "°/s²",
    "_rad_s": "rad/s",
    "_deg_s": "°/s",
    "_m_s3": "m/s³",
    "_m_s2": "m/s²",
    "_m_s": "m/s",
    "_per_s4": "1/s⁴",
    "_per_s2": "1/s²",
    "_per_s": "1/s",
    "_per_m": "1/m",
    "_percent": "%",
    "_deg": "°",
    "_rad": "rad",
    "_kg": "kg",
    "_hz": "Hz",
    "_ms": "ms",
    "_m": "m",
    "_s": "s",
}
"""Unit by suffix of a key; the first suffix that fits is used."""


def unit_of(name: str) -> str:
    """The unit of a key or a measured figure, from its suffix; empty without a unit."""
    return next((unit for suffix, unit in _UNITS.items() if name.endswith(suffix)), "")


def seconds(milliseconds: float) -> float:
    """Milliseconds in s."""
    return 1e-3 * milliseconds


def share(percent: float) -> float:
    """Percent as a share of 1.

    `companion.vehicle.state` divides a measured percentage in the same way, so a measured value
    that equals a limit in percent also equals it as a share.
    """
    return percent / 100.0


_CONVERSIONS: dict[str, Conversion] = {
    "_deg": radians,
    "_deg_s": radians,
    "_deg_s2": radians,
    "_ms": seconds,
    "_percent": share,
}
"""Conversion to SI (rad, rad/s, rad/s², s, share of 1) by the suffix of a key."""


def converted(value: float | None, convert: Conversion) -> float | None:
    """A value that may be null, in SI units."""
    return None if value is None else convert(value)


class Si(property):
    """A key's value in SI units, as a property beside the key that the user writes.

    `max_tilt = Si("max_tilt_deg")` is read as `limits.max_tilt`, in rad. Pydantic does not take
    a property for a key.
    """

    def __init__(self, key: str) -> None:
        convert = next(each for suffix, each in _CONVERSIONS.items() if key.endswith(suffix))
        super().__init__(lambda section: convert(getattr(section, key)))

    @overload
    def __get__(self, section: None, owner: type, /) -> Self: ...
    @overload
    def __get__(self, section: Any, owner: type | None = None, /) -> float: ...
    def __get__(self, section: Any, owner: type | None = None, /) -> Self | float:
        """The value of the key in that section, in SI units."""
        return self if section is None else float(super().__get__(section, owner))
