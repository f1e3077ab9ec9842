"""The flight modes the mock knows, apart from any autopilot's numbers for them."""

from enum import Enum, auto


class Mode(Enum):
    """A flight mode, as its autopilot calls it: PX4's down to OFFBOARD, then ArduCopter's own."""

    MANUAL = auto()
    ALTCTL = auto()
    POSCTL = auto()
    STABILIZED = auto()
    LOITER = auto()
    TAKEOFF = auto()
    RTL = auto()
    LAND = auto()
    OFFBOARD = auto()
    STABILIZE = auto()
    ALT_HOLD = auto()
    GUIDED = auto()
    BRAKE = auto()
