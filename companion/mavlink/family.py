"""What differs between autopilots, behind one face."""

from collections.abc import Mapping
from typing import Protocol

from companion.mavlink.command import Command
from companion.mavlink.errors import UnsupportedAutopilot
from companion.mavlink.px4 import Px4
from companion.mavlink.readiness import Readiness

MAV_AUTOPILOT_PX4 = 12


class AutopilotFamily(Protocol):
    """How to speak to one kind of autopilot.

    Attributes:
        name: For people, such as `PX4`.
        autopilot: MAV_AUTOPILOT number.
        offboard_mode: Name of the mode in which it obeys body rates.
        takeoff_mode: Name of the mode in which it takes off.
        hold_mode: Name of the mode that holds position.
        land_mode: Name of the mode that lands here.
        modes: `custom_mode` of each mode that may be entered, by name.
        bytewise_parameters: Whether integer parameters travel as bytes.
        tilt_compensated: Whether the autopilot itself divides thrust by cos(tilt) in rate mode.
        wanted_rates: Messages the flight needs, with the rate to ask for, Hz.
    """

    name: str
    autopilot: int
    offboard_mode: str
    takeoff_mode: str
    hold_mode: str
    land_mode: str
    modes: Mapping[str, int]
    bytewise_parameters: bool
    tilt_compensated: bool
    wanted_rates: Mapping[str, float]

    def mode_name(self, custom_mode: int) -> str:
        """Name of the mode in a heartbeat; for an unknown one its number."""

    def set_mode(self, name: str) -> Command:
        """Command that enters a mode of `modes`. Raises `KeyError` for any other."""

    def not_ready(self, readiness: Readiness) -> str | None:
        """What still is missing before it can be armed and flown, or `None`."""

    def arm(self) -> Command:
        """Command that arms, with all checks."""

    def disarm(self) -> Command:
        """Command that disarms on the ground."""

    def take_off(self, altitude_amsl_m: float) -> Command:
        """Command that takes off to an altitude above mean sea level, m, from an armed hold."""

    def land(self) -> Command:
        """Command that lands at the present place."""


def family_for(autopilot: int) -> AutopilotFamily:
    """The family of a heartbeat's `autopilot` number.

    Raises:
        UnsupportedAutopilot: None of ours.
    """
    if autopilot == MAV_AUTOPILOT_PX4:
        return Px4()
    raise UnsupportedAutopilot(
        f"the vehicle's autopilot (MAV_AUTOPILOT {autopilot}) is not supported; this version "
        "flies PX4 (12)"
    )
