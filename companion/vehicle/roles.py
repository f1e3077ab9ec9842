"""What a mode of the autopilot means to a flight, whatever the family calls it."""

from enum import Enum


class Role(Enum):
    """What a flight passes through; a mode that plays none of these is somebody else's doing."""

    TAKEOFF = "take-off"
    READY = "ready"
    """Our rates may be obeyed from here on."""
    HOLD = "hold"
    OFFBOARD = "offboard"
    LAND = "land"
