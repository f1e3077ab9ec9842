"""Whether the vehicle still is in a mode of the flight's own."""

from collections.abc import Callable, Set

from companion.safety.ending import Exit, FlightEnded
from companion.vehicle.autopilot import Role
from companion.vehicle.link import Link


def roles_of(link: Link) -> frozenset[Role]:
    """What the present mode is to a flight; empty for one that is not ours, or not known yet."""
    mode = link.state.mode
    return frozenset() if mode is None else link.autopilot.roles(mode)


def in_role(link: Link, role: Role) -> bool:
    """Whether the present mode is that to a flight."""
    return role in roles_of(link)


def require_role(link: Link, allowed: Set[Role]) -> None:
    """Let the vehicle go if it is in a mode that is not ours.

    Raises:
        FlightEnded: with who, as far as can be known, took it.
    """
    if roles_of(link) & allowed:
        return
    who = (
        "the autopilot's failsafe took over"
        if link.state.mode_by_failsafe
        else "the pilot or another station took over"
    )
    raise FlightEnded(f"{who}: mode {link.state.mode}", Exit.RELEASE)


def in_roles(link: Link, allowed: Set[Role]) -> Callable[[], None]:
    """`require_role` to be called later."""
    return lambda: require_role(link, allowed)
