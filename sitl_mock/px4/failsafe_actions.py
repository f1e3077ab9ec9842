"""What PX4's failsafes may do, by which parameter, and for which cause (source: PX4's failsafe)."""

from enum import Enum
from typing import NamedTuple

from sitl_mock.autopilot.modes import Mode


class Action(NamedTuple):
    """What a failsafe does: its number in PX4's events and its mode, None = motors off."""

    number: int
    mode: Mode | None


POSITION, ALTITUDE = Action(2, Mode.POSCTL), Action(3, Mode.ALTCTL)
STABILIZED = Action(4, Mode.STABILIZED)
HOLD, RETURN, LAND = Action(5, Mode.LOITER), Action(6, Mode.RTL), Action(7, Mode.LAND)
DISARM, TERMINATE = Action(9, None), Action(10, None)

OFFBOARD_ACTIONS = {
    0: POSITION,
    1: ALTITUDE,
    2: STABILIZED,
    3: RETURN,
    4: LAND,
    5: HOLD,
    6: TERMINATE,
    7: DISARM,
}
"""COM_OBL_RC_ACT -> action; without a pilot, those that need one return instead (measured)."""
LINK_ACTIONS = {1: HOLD, 2: RETURN, 3: LAND, 5: TERMINATE, 6: DISARM}
"""NAV_DLL_ACT and NAV_RCL_ACT -> action."""


class Cause(Enum):
    """Why a failsafe is active; a later one never replaces an earlier of a higher value.

    Each with its number in PX4's events, 0 where PX4 gives none.
    """

    OFFBOARD_LOST = (1, 0)
    PILOT_LOST = (2, 1)
    GCS_LOST = (3, 2)
    BATTERY = (4, 4)
    POSITION_LOST = (5, 0)

    @property
    def rank(self) -> int:
        """How grave it is."""
        return self.value[0]

    @property
    def number(self) -> int:
        """Its number in PX4's events."""
        return self.value[1]
