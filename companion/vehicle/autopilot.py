"""What differs between autopilots, declared as data and commands behind one Protocol.

A further autopilot is a folder beside `px4` and `ardupilot`, and one line in `registry.py`.
"""

from collections.abc import Mapping
from enum import Enum
from types import MappingProxyType
from typing import NamedTuple, Protocol

from companion.mavlink.commands import Command
from companion.vehicle.parameter_rules import ParameterRule


class Role(Enum):
    """What a mode means to a flight, whatever the autopilot calls it.

    A mode without a role belongs to the pilot or to a failsafe.
    """

    TAKEOFF = "take-off"
    READY = "ready"
    """The vehicle may be taken over from here."""
    HOLD = "hold"
    OFFBOARD = "offboard"
    """The autopilot obeys our body rates."""
    LAND = "land"


class Readiness(NamedTuple):
    """Telemetry that decides whether a vehicle can be armed and flown; `None`: not received.

    Attributes:
        prearm_good: The autopilot's own pre-arm checks pass.
        estimator_flags: ESTIMATOR_STATUS_FLAGS.
        position: A finite local position was received.
        home: The home position was received.
    """

    prearm_good: bool | None
    estimator_flags: int | None
    position: bool
    home: bool


class ControlEntry(Enum):
    """How an autopilot comes to obey our setpoints."""

    BY_COMMAND = "a mode command, once setpoints have streamed for a second"
    BY_FIRST_SETPOINT = "the first setpoint; so none may be sent before the takeover"


class OffboardLossFailsafe(NamedTuple):
    """What the autopilot does when our setpoints stop.

    Attributes:
        parameter: Name of the parameter that sets how long it holds the last rates, s.
        then: What it does after that, in words.
        brakes: Whether it then stops the vehicle.
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
"""Messages that a flight needs from any autopilot, with the rate to request, Hz."""


class Autopilot(Protocol):
    """How to command one kind of autopilot, and what its modes and parameters mean to a flight.

    Every autopilot takes thrust as 0..1 of the collective; `parameters` checks that, and whether it
    divides by cos(tilt) itself. Every autopilot holds the last rates for a while when setpoints
    stop, and obeys a later setpoint unless a mode was commanded in between.

    Attributes:
        name: For people, such as `PX4`.
        mav_autopilot: MAV_AUTOPILOT number.
        modes: `custom_mode` of each mode that may be commanded, by name.
        ready_mode: Name of the mode in which a pilot who armed hands the vehicle over to us.
        offboard_mode: Name of the mode in which it obeys our setpoints.
        control_entry: How it comes to obey them.
        bytewise_parameters: Whether integer parameters travel as bytes.
        wanted_rates: Messages the flight needs, with the rate to request, Hz.
        interval_step_us: SET_MESSAGE_INTERVAL is rounded down to whole multiples of this.
        rates_along_target: Whether it takes body rates along the axes of ATTITUDE_TARGET, an
            attitude that turns before the body follows. Otherwise along the body's own axes.
        body_yaw_is_relative: Whether a yaw in a body frame of SET_POSITION_TARGET_LOCAL_NED counts
            from the present yaw, not from north.
        offboard_loss_failsafe: What it does when setpoints stop.
        cannot_arm_in: Roles of the modes in which it cannot be armed once it stands disarmed.
        parameters: Rules for the parameters that matter to a flight by body rates.
    """

    name: str
    mav_autopilot: int
    modes: Mapping[str, int]
    ready_mode: str
    offboard_mode: str
    control_entry: ControlEntry
    bytewise_parameters: bool
    wanted_rates: Mapping[str, float]
    interval_step_us: int
    rates_along_target: bool
    body_yaw_is_relative: bool
    offboard_loss_failsafe: OffboardLossFailsafe
    cannot_arm_in: frozenset[Role]
    parameters: tuple[ParameterRule, ...]

    def mode_name(self, base_mode: int, custom_mode: int) -> str:
        """Name of the mode in a heartbeat; for an unknown mode its number."""

    def roles(self, mode: str) -> frozenset[Role]:
        """Roles of the mode of that name (see `mode_name`); empty: the mode has none."""

    def set_mode(self, name: str) -> Command:
        """Command that enters a mode of `modes`. Raises `KeyError` for any other."""

    def not_ready(self, readiness: Readiness) -> str | None:
        """What is still missing before it can be armed and flown, or `None`."""

    def arm(self) -> tuple[Command, ...]:
        """Commands that prepare our take-off and arm it with all checks, in order."""

    def disarm(self) -> Command:
        """Command that disarms on the ground."""

    def take_off(self, height_m: float, home_altitude_m: float) -> Command:
        """Command that takes off from where it stands armed.

        Args:
            height_m: To reach, above home.
            home_altitude_m: Of home, above mean sea level.
        """

    def hold(self) -> Command:
        """Command by which it holds position by itself, without a pilot's sticks."""

    def land(self) -> Command:
        """Command by which it lands at the present place."""
