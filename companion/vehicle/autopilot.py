"""The interface of an autopilot: what differs between autopilots, as data and commands.

To add an autopilot, add a folder beside `px4` and `ardupilot`, and one line in `registry.py`.
"""

from collections.abc import Mapping
from enum import Enum
from types import MappingProxyType
from typing import NamedTuple, Protocol

from companion.mavlink.commands import Command
from companion.vehicle.parameter_rules import ParameterRule


class Role(Enum):
    """Meaning of a mode for a flight, independent of the autopilot's name for it.

    Only the pilot or a failsafe uses the modes without a role.
    """

    TAKEOFF = "take-off"
    READY = "ready"
    """Offboard control may begin in this mode."""
    HOLD = "hold"
    OFFBOARD = "offboard"
    """The autopilot obeys the body rates that are sent."""
    LAND = "land"


class Readiness(NamedTuple):
    """Telemetry that decides whether a vehicle can be armed and flown; `None`: not known now."""

    prearm_passed: bool | None
    """Whether the autopilot's own pre-arm checks pass."""
    estimator_flags: int | None
    """ESTIMATOR_STATUS_FLAGS."""
    has_position: bool
    """Whether a finite local position was received in the last 5 s."""
    has_home: bool
    """Whether the home position was received."""


class ControlEntry(Enum):
    """How an autopilot begins to obey setpoints."""

    BY_COMMAND = "a mode command, once setpoints have streamed for a second"
    BY_FIRST_SETPOINT = "the first setpoint; so none may be sent before the takeover"


class OffboardLossFailsafe(NamedTuple):
    """What the autopilot does when setpoints stop."""

    parameter: str
    """Name of the parameter for the time in which the autopilot holds the last body rates, s."""
    action: str
    """What the autopilot does when it no longer holds the last body rates, in words."""
    brakes: bool
    """Whether `action` brakes the vehicle to a stop."""


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
"""Messages that a flight needs from every autopilot, with the requested rate, Hz.

`Autopilot.wanted_rates` may replace a rate. Section `link` of the configuration sets the rates of
ATTITUDE_QUATERNION and LOCAL_POSITION_NED."""


class Autopilot(Protocol):
    """How to command one kind of autopilot, and what its modes and parameters mean to a flight.

    Every autopilot takes collective thrust as 0..1. When setpoints stop, the autopilot holds the
    last rates for a while, and obeys a later setpoint unless a mode was commanded meanwhile.

    Attributes:
        name: name to show to users, such as `PX4`.
        mav_autopilot: MAV_AUTOPILOT number.
        modes: `custom_mode` of each mode that may be commanded, by name.
        ready_mode: name of the mode in which this program arms, and which a pilot who has armed
            enters to hand over control.
        offboard_mode: name of the mode in which the autopilot obeys setpoints.
        control_entry: how the autopilot begins to obey setpoints.
        bytewise_parameters: whether integer parameters are sent as bytes; see
            `companion.mavlink.parameters`.
        wanted_rates: messages that a flight needs, with the rate to request, Hz.
        interval_step_us: SET_MESSAGE_INTERVAL is rounded down to a whole multiple of this, us.
        rates_about_target_axes: True: body rates act about the axes of the attitude setpoint
            (ATTITUDE_TARGET), which leads the body. False: about the axes of the body.
        body_yaw_is_relative: whether a yaw in a body frame of SET_POSITION_TARGET_LOCAL_NED counts
            from the present yaw, not from north.
        can_compensate_tilt: whether the autopilot can divide thrust by cos(tilt) itself; a rule in
            `parameters` then compares its setting with the configuration.
        modes_begin_level: whether the autopilot's own modes begin level. A vehicle that leaned
            against the wind then drifts downwind until the integral of the mode has grown.
        offboard_loss_failsafe: what the autopilot does when setpoints stop.
        fence_text: part of the STATUSTEXT by which the geofence announces a change of mode; None:
            HEARTBEAT or CURRENT_MODE reports the change as a failsafe.
        cannot_arm_in: roles of the modes in which a disarmed vehicle cannot be armed.
        parameters: rules for the parameters that matter to a flight by body rates.
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
    rates_about_target_axes: bool
    body_yaw_is_relative: bool
    can_compensate_tilt: bool
    modes_begin_level: bool
    offboard_loss_failsafe: OffboardLossFailsafe
    fence_text: str | None
    cannot_arm_in: frozenset[Role]
    parameters: tuple[ParameterRule, ...]

    def mode_name(self, base_mode: int, custom_mode: int) -> str:
        """Name of the mode in a heartbeat; an unknown mode is named by its number."""

    def roles(self, mode: str) -> frozenset[Role]:
        """What the mode of this name (see `mode_name`) is used for in a flight; may be empty."""

    def set_mode(self, name: str) -> Command:
        """Command that enters a mode of `modes`. Raises `KeyError` for any other mode."""

    def why_not_ready(self, readiness: Readiness) -> str | None:
        """What is missing before the vehicle can be armed and flown, in words; `None`: nothing."""

    def take_off(self, height_m: float, home_altitude_m: float) -> Command:
        """Command by which the armed vehicle takes off from the ground.

        Args:
            height_m: height to reach, above home, m.
            home_altitude_m: altitude of home above mean sea level, m.
        """

    def hold(self) -> Command:
        """Command by which the autopilot holds position without a pilot."""

    def land(self) -> Command:
        """Command by which the vehicle lands at its present place."""
