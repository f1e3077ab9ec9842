"""The families that this program flies."""

from collections.abc import Callable

from companion.mavlink.errors import UnsupportedAutopilot
from companion.mavlink.router import Router
from companion.mavlink.texts import TextAssembler
from companion.vehicle.ardupilot.autopilot import ArduPilot
from companion.vehicle.autopilot import AutopilotFamily
from companion.vehicle.px4.autopilot import Px4
from companion.vehicle.px4.events import EventReader

FAMILIES: tuple[AutopilotFamily, ...] = (Px4(), ArduPilot())

FAMILY_NAMES = " or ".join(f"{family.name} ({family.autopilot})" for family in FAMILIES)
"""For people, with their MAV_AUTOPILOT numbers."""

MULTIROTORS = frozenset({2, 3, 13, 14, 15, 29, 35})
"""MAV_TYPE of four, two coaxial, six, eight, three, twelve and ten rotors."""


def family_for(autopilot: int, vehicle_type: int) -> AutopilotFamily:
    """The family of a heartbeat's `autopilot` and `type`.

    Raises:
        UnsupportedAutopilot: None of ours, or no multirotor: the same mode numbers mean something
            else to a plane.
    """
    if vehicle_type not in MULTIROTORS:
        raise UnsupportedAutopilot(
            f"the vehicle (MAV_TYPE {vehicle_type}) is no multirotor, and only those are flown"
        )
    for family in FAMILIES:
        if family.autopilot == autopilot:
            return family
    raise UnsupportedAutopilot(
        f"the vehicle's autopilot (MAV_AUTOPILOT {autopilot}) is not supported; this version "
        f"flies {FAMILY_NAMES}"
    )


def read_events(router: Router, texts: TextAssembler, clock: Callable[[], float]) -> None:
    """Turn the events that PX4 sends where it sends no STATUSTEXT into texts.

    Args:
        router: brings EVENT.
        texts: takes the words.
        clock: loop time, s.
    """
    router.subscribe_raw("EVENT", EventReader(texts, clock).take)
