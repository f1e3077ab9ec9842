"""What a mode of the autopilot means to a flight, whatever the family calls it."""

from enum import Enum

from companion.mavlink.family import AutopilotFamily


class Role(Enum):
    """The modes that a flight passes through; every other mode is somebody else's doing."""

    TAKEOFF = "take-off"
    HOLD = "hold"
    OFFBOARD = "offboard"
    LAND = "land"


def mode_name(family: AutopilotFamily, role: Role) -> str:
    """What the family calls the mode in this role."""
    return {
        Role.TAKEOFF: family.takeoff_mode,
        Role.HOLD: family.hold_mode,
        Role.OFFBOARD: family.offboard_mode,
        Role.LAND: family.land_mode,
    }[role]


def role_of(family: AutopilotFamily, mode: str | None) -> Role | None:
    """The role of a mode; None for a mode that is not ours, or not known yet."""
    return next((role for role in Role if mode_name(family, role) == mode), None)
