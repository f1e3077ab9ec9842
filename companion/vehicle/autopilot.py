"""What differs between autopilots, behind one face.

A further family is a folder beside `px4` and `ardupilot`, and one line in `registry.py`.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple, Protocol

from companion.mavlink.command import Command
from companion.vehicle.parameter_rules import ParameterRule
from companion.vehicle.readiness import Readiness
from companion.vehicle.roles import Role


class OffboardLossFailsafe(NamedTuple):
    """What the autopilot does when our setpoints stop.

    Attributes:
        parameter: Sets for how long, in s, it holds the last rates; see `AutopilotFamily`.
        then: What follows, in words.
        brakes: Whether it stops the vehicle then.
    """

    parameter: str
    then: str
    brakes: bool


FLIGHT_RATES: Mapping[str, float] = MappingProxyType(
    {
        "ATTITUDE_QUATERNION": 250.0,
        "LOCAL_POSITION_NED": 50.0,
        "EXTENDED_SYS_STATE": 5.0,
        "ATTITUDE_TARGET": 10.0,
        "SYS_STATUS": 5.0,
        "BATTERY_STATUS": 1.0,
        "GPS_RAW_INT": 5.0,
        "GLOBAL_POSITION_INT": 5.0,
    }
)
"""What a flight needs of any autopilot, with the rate to ask for, Hz."""


class AutopilotFamily(Protocol):
    """How to speak to one kind of autopilot, and what its words mean to a flight.

    Thrust is 0..1 of the collective in every family; what a vehicle must be set to for that, and
    whether it divides by cos(tilt) itself, is told by `parameters`. All of them hold the last rates
    for a while when setpoints stop, and obey a later one unless a mode was commanded meanwhile.

    Attributes:
        name: For people, such as `PX4`.
        autopilot: MAV_AUTOPILOT number.
        modes: `custom_mode` of each mode that may be entered, by name.
        ready_mode: Name of the mode in which a pilot who armed hands the vehicle over to us.
        bytewise_parameters: Whether integer parameters travel as bytes.
        wanted_rates: Messages the flight needs, with the rate to ask for, Hz.
        interval_step_us: SET_MESSAGE_INTERVAL counts in whole multiples of this.
        rates_along_target: Whether it takes body rates along the axes of ATTITUDE_TARGET, an
            attitude that they turn before the body follows. Else along the body's own.
        offboard_loss_failsafe: What it does when setpoints stop.
        unready_in: What the modes are to a flight in which it stands disarmed and never is ready.
        parameters: Those that matter to a flight by body rates.
    """

    name: str
    autopilot: int
    modes: Mapping[str, int]
    ready_mode: str
    bytewise_parameters: bool
    wanted_rates: Mapping[str, float]
    interval_step_us: int
    rates_along_target: bool
    offboard_loss_failsafe: OffboardLossFailsafe
    unready_in: frozenset[Role]
    parameters: tuple[ParameterRule, ...]

    def mode_name(self, base_mode: int, custom_mode: int) -> str:
        """Name of the mode in a heartbeat; for an unknown one its number."""

    def roles(self, mode: str) -> frozenset[Role]:
        """What the mode of that name, as `mode_name` gives it, is to a flight; empty: none."""

    def set_mode(self, name: str) -> Command:
        """Command that enters a mode of `modes`. Raises `KeyError` for any other."""

    def not_ready(self, readiness: Readiness) -> str | None:
        """What still is missing before it can be armed and flown, or `None`."""

    def arm(self) -> tuple[Command, ...]:
        """Commands that make it ready for our take-off and arm it, with all checks, in order."""

    def disarm(self) -> Command:
        """Command that disarms on the ground."""

    def take_off(self, height_m: float, home_altitude_m: float) -> Command:
        """Command that takes off from where it stands armed.

        Args:
            height_m: To reach, above home.
            home_altitude_m: Of home, above mean sea level.
        """

    def take_over(self) -> Command | None:
        """Command by which it obeys the setpoints that have been streaming for a second.

        `None`: it obeys the first one, so none may leave before that is wanted.
        """

    def hold(self) -> Command:
        """Command by which it holds position by itself, without a pilot's sticks."""

    def land(self) -> Command:
        """Command by which it lands at the present place."""
