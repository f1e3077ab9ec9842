"""Channels of `flight.mcap` whose messages are numbers: their schemas and their bytes.

Each message is a ROS 2 message in CDR: 4 bytes of header, then all float64 fields, then all uint8
fields. So every message of a channel has the same length, and NumPy reads many at once.
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

CDR_HEADER = b"\x00\x01\x00\x00"
"""Header of a little-endian CDR message."""
PACKAGE = "companion_msgs/msg"

Rows = NDArray[np.void]
"""A structured array: one row per message, one named field per column."""


class MessageType(NamedTuple):
    """A message type: its ROS 2 name and its definition (ros2msg)."""

    name: str
    schema: bytes


@dataclass(frozen=True, slots=True)
class Field:
    """One column of a channel."""

    name: str
    """Name, which ends with the unit if there is one."""
    meaning: str


@dataclass(frozen=True, slots=True)
class CodeField(Field):
    """A column of codes: small integers, each with a name."""

    names: tuple[str, ...] = ("no", "yes")
    """The names of the codes 0, 1, 2 and so on."""


@dataclass(frozen=True)
class Channel:
    """A channel of numbers."""

    topic: str
    """Name in the file, with a leading slash."""
    meaning: str
    numbers: tuple[Field, ...]
    """The float64 columns. NaN: unknown or not applicable."""
    codes: tuple[CodeField, ...] = ()
    """The uint8 columns."""

    @property
    def name(self) -> str:
        """The topic without its slash; this is how the reader names the channel."""
        return self.topic[1:]

    @property
    def type(self) -> MessageType:
        """The message type; its definition has a constant for each name of a code."""
        words = "".join(word.capitalize() for word in self.name.split("_"))
        lines = [f"# {self.meaning}"]
        for field in self.numbers:
            lines += [f"# {field.meaning}", f"float64 {field.name}"]
        for code in self.codes:
            lines.append(f"# {code.meaning}")
            if code.names != ("no", "yes"):
                lines += [
                    f"uint8 {code.name.upper()}_{name.upper()}={number}"
                    for number, name in enumerate(code.names)
                ]
            lines.append(f"uint8 {code.name}")
        return MessageType(f"{PACKAGE}/{words}", ("\n".join(lines) + "\n").encode())

    @property
    def columns(self) -> tuple[str, ...]:
        """The names of the columns, in the order of the bytes."""
        return tuple(field.name for field in (*self.numbers, *self.codes))

    @cached_property
    def packing(self) -> struct.Struct:
        """The packing of the header and the columns of one message."""
        return struct.Struct(f"<4s{len(self.numbers)}d{len(self.codes)}B")

    @cached_property
    def dtype(self) -> np.dtype[np.void]:
        """The columns of the structured array that the reader returns."""
        return np.dtype(
            [(field.name, "<f8") for field in self.numbers]
            + [(code.name, "u1") for code in self.codes]
        )

    def rows(self, messages: list[bytes]) -> Rows:
        """All messages of the channel, in the order of the file, as a structured array.

        Raises:
            ValueError: a message has another length, or a code without a name.
        """
        length = self.packing.size
        if any(len(message) != length for message in messages):
            raise ValueError(f"{self.topic}: a message is not of {length} bytes")
        rows = np.frombuffer(b"".join(message[4:] for message in messages), self.dtype)
        for code in self.codes:
            if len(rows) and rows[code.name].max() >= len(code.names):
                raise ValueError(
                    f"{self.topic}: {code.name} is {rows[code.name].max()}, a value that this "
                    "version does not know"
                )
        return rows


def matrix(rows: Rows, names: Sequence[str]) -> NDArray[np.float64]:
    """(N, len(names)), these columns of the rows."""
    return np.column_stack([rows[name] for name in names])
