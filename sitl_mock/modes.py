"""The flight modes the mock knows, apart from any autopilot's numbers for them."""

from enum import Enum, auto


class Mode(Enum):
    """A flight mode."""

    MANUAL = auto()
    ALTCTL = auto()
    POSCTL = auto()
    STABILIZED = auto()
    LOITER = auto()
    TAKEOFF = auto()
    RTL = auto()
    LAND = auto()
    OFFBOARD = auto()


PILOTED = frozenset({Mode.MANUAL, Mode.ALTCTL, Mode.POSCTL, Mode.STABILIZED})
"""Modes that need a pilot's sticks."""

NEEDS_POSITION = frozenset({Mode.POSCTL, Mode.LOITER, Mode.TAKEOFF, Mode.RTL})
"""Modes that need a horizontal position."""
