"""The autopilots that this program flies."""

from collections.abc import Callable

from companion.mavlink.dispatcher import MessageDispatcher
from companion.mavlink.errors import UnsupportedAutopilot
from companion.mavlink.texts import TextAssembler
from companion.vehicle.ardupilot.autopilot import ArduPilot
from companion.vehicle.autopilot import Autopilot
from companion.vehicle.px4.autopilot import Px4
from companion.vehicle.px4.events import EventReader

AUTOPILOTS: tuple[Autopilot, ...] = (Px4(), ArduPilot())

AUTOPILOTS_BY_NUMBER = {autopilot.mav_autopilot: autopilot for autopilot in AUTOPILOTS}
"""The autopilots by MAV_AUTOPILOT."""

AUTOPILOT_NAMES = " or ".join(
    f"{autopilot.name} ({autopilot.mav_autopilot})" for autopilot in AUTOPILOTS
)
"""Names for users, with the MAV_AUTOPILOT numbers."""

MULTIROTORS = frozenset({2, 3, 13, 14, 15, 29, 35})
"""MAV_TYPE of multirotors: quadrotor, coaxial, hexa-, octo-, tri-, dodeca- and decarotor."""


def autopilot_for(mav_autopilot: int, vehicle_type: int) -> Autopilot:
    """The autopilot of a heartbeat with these `autopilot` and `type` fields.

    Raises:
        UnsupportedAutopilot: this program cannot fly the autopilot, or the vehicle is not a
            multirotor: on a plane the same mode numbers mean something else.
    """
    if vehicle_type not in MULTIROTORS:
        raise UnsupportedAutopilot(
            f"the vehicle (MAV_TYPE {vehicle_type}) is no multirotor; this program flies only "
            "multirotors"
        )
    if mav_autopilot in AUTOPILOTS_BY_NUMBER:
        return AUTOPILOTS_BY_NUMBER[mav_autopilot]
    raise UnsupportedAutopilot(
        f"the vehicle's autopilot (MAV_AUTOPILOT {mav_autopilot}) is not supported; this version "
        f"flies {AUTOPILOT_NAMES}"
    )


def read_events(
    dispatcher: MessageDispatcher, texts: TextAssembler, clock: Callable[[], float]
) -> None:
    """Turn PX4's events into texts; on some links PX4 sends events instead of STATUSTEXT.

    `clock` returns the event-loop time, s.
    """
    dispatcher.subscribe_raw("EVENT", EventReader(texts, clock).take)
