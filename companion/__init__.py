"""Companion computer for MAVLink: sends body rates for a linear horizontal acceleration.

To fly from Python, see `help(companion.connect)`, `help(companion.Vehicle)` and
`help(companion.Control)`. They are imported when they are asked for, so that the command line
starts quickly.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from companion.api import (
        Coefficients,
        Control,
        FlightEnded,
        Reference,
        State,
        Vehicle,
        connect,
        run,
    )

__all__ = [
    "Coefficients",
    "Control",
    "FlightEnded",
    "Reference",
    "State",
    "Vehicle",
    "connect",
    "run",
]


def __getattr__(name: str) -> object:
    """Import one of the public names when a program first uses it."""
    if name not in __all__:
        raise AttributeError(f"module 'companion' has no attribute {name!r}")
    from companion import api  # noqa: PLC0415  takes a quarter of a second

    return getattr(api, name)


def __dir__() -> list[str]:
    """The public names too, so that an interactive Python completes them before their import."""
    return sorted({*globals(), *__all__})
