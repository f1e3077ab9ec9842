"""The autopilot's parameters: typed values by name and by index, and their MAVLink encoding."""

import math
import struct
import zlib
from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple, Protocol

from pymavlink.dialects.v20 import development as dialect

INT32 = int(dialect.MAV_PARAM_TYPE_INT32)
REAL32 = int(dialect.MAV_PARAM_TYPE_REAL32)
UINT32 = int(dialect.MAV_PARAM_TYPE_UINT32)


class Parameter(NamedTuple):
    """A parameter's name and value; an ``int`` makes it an integer, a ``float`` a REAL32.

    PX4's integers are INT32; ArduPilot's have their own types (`FloatEncoding`).
    """

    name: str
    value: int | float


class ParameterRefusedError(Exception):
    """The parameter cannot have this value or type."""


class Encoding(Protocol):
    """How an autopilot encodes parameters in messages."""

    has_hash: bool
    """Whether the list begins with a hash of all values."""
    sends_index: bool
    """Whether the answer to a PARAM_SET, or to a read by name, contains the parameter's index."""

    def to_wire(self, name: str, value: int | float) -> tuple[float, int]:
        """Return (param_value, param_type)."""

    def from_wire(self, name: str, value: float, param_type: int) -> int | float:
        """Return the value carried by a PARAM_SET.

        Raises:
            ParameterRefusedError: a type or a value that the parameter cannot have.
        """


class BytewiseEncoding:
    """PX4's encoding: the float field carries the bytes of an integer."""

    has_hash = True
    sends_index = True

    def to_wire(self, name: str, value: int | float) -> tuple[float, int]:
        """Return (param_value, param_type)."""
        if isinstance(value, int):
            return float(struct.unpack("<f", struct.pack("<i", value))[0]), INT32
        return value, REAL32

    def from_wire(self, name: str, value: float, param_type: int) -> int | float:
        """Return the value carried by a PARAM_SET.

        Raises:
            ParameterRefusedError: a type that PX4 does not have, or a value that is not finite.
        """
        if param_type == INT32:
            return int(struct.unpack("<i", struct.pack("<f", value))[0])
        if param_type == REAL32:
            if not math.isfinite(value):
                raise ParameterRefusedError("the value is not finite")
            return value
        raise ParameterRefusedError(f"parameter type {param_type} is neither INT32 nor REAL32")


class FloatEncoding:
    """ArduPilot's encoding: a float for every type; values of integer types are truncated.

    Args:
        types: MAV_PARAM_TYPE by name.
    """

    has_hash = False
    sends_index = False

    def __init__(self, types: Mapping[str, int]) -> None:
        self._types = types

    def to_wire(self, name: str, value: int | float) -> tuple[float, int]:
        """Return (param_value, param_type)."""
        return float(value), self._types[name]

    def from_wire(self, name: str, value: float, param_type: int) -> int | float:
        """Return the value carried by a PARAM_SET; its type field is ignored.

        Raises:
            ParameterRefusedError: the value is not finite.
        """
        if not math.isfinite(value):
            raise ParameterRefusedError("the value is not finite")
        return value if self._types[name] == REAL32 else int(value)


class ParameterTable:
    """All parameters, sorted by name; the position in this order is the MAVLink index.

    Args:
        defaults: the autopilot's parameters.
        overrides: values from the configuration, by name.

    Raises:
        KeyError: an override names no parameter.
        ParameterRefusedError: an override of the wrong type, or too large.
    """

    def __init__(self, defaults: Iterable[Parameter], overrides: dict[str, float]) -> None:
        self._values = dict(sorted(defaults))
        self._names = list(self._values)
        for name, value in overrides.items():
            is_integer = isinstance(self._values[name], int) and float(value).is_integer()
            self.set(name, int(value) if is_integer else float(value))

    def __len__(self) -> int:
        return len(self._names)

    def __contains__(self, name: object) -> bool:
        return name in self._values

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __getitem__(self, name: str) -> int | float:
        return self._values[name]

    def name_of(self, index: int) -> str:
        """Return the name at an index.

        Raises:
            IndexError: no such index.
        """
        if not 0 <= index < len(self._names):
            raise IndexError(index)
        return self._names[index]

    def index_of(self, name: str) -> int:
        """Return a parameter's index."""
        return self._names.index(name)

    def set(self, name: str, value: int | float) -> None:
        """Change a value.

        Raises:
            KeyError: no such parameter.
            ParameterRefusedError: the type differs from the parameter's, or the value does not fit
                into 32 bits.
        """
        if type(value) is not type(self._values[name]):
            type_name = "an integer" if isinstance(self._values[name], int) else "a float"
            raise ParameterRefusedError(f"{name} must be {type_name}")
        layout = "<f" if isinstance(value, float) else "<i"
        try:
            self._values[name] = struct.unpack(layout, struct.pack(layout, value))[0]
        except (OverflowError, struct.error) as error:
            reason = f"{value:g} does not fit into the 32 bits of {name}"
            raise ParameterRefusedError(reason) from error

    def hash(self) -> int:
        """Return PX4's ``_HASH_CHECK``: the CRC-32 over all names and values, in index order."""
        crc = 0xFFFFFFFF  # zlib inverts before and after; PX4 does not
        for name, value in self._values.items():
            layout = "<i" if isinstance(value, int) else "<f"
            crc = zlib.crc32(name.encode() + struct.pack(layout, value), crc)
        return crc ^ 0xFFFFFFFF
