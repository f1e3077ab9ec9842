"""What a mode of the autopilot means to a flight, whatever the family calls it."""

from collections.abc import Set
from enum import Enum

from companion.flight.ending import Exit, FlightEnded
from companion.mavlink.family import AutopilotFamily
from companion.mavlink.link import Link


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


def require_role(link: Link, allowed: Set[Role]) -> None:
    """Let the vehicle go if it is in a mode that is not ours.

    Raises:
        FlightEnded: with who, as far as can be known, took it.
    """
    if role_of(link.family, link.state.mode) in allowed:
        return
    who = (
        "the autopilot's failsafe took over"
        if link.state.failsafe
        else "the pilot or another station took over"
    )
    raise FlightEnded(f"{who}: mode {link.state.mode}", Exit.LET_GO)
