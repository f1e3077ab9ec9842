"""ArduCopter: its mode numbers, the messages to request from it, and its commands.

Sources: ArduCopter's `mode.h`, `GCS_MAVLink_Copter.cpp`, `mode_guided.cpp`. The figures were
measured on ArduCopter 4.7 in simulation, 2025.
"""

from collections.abc import Mapping
from types import MappingProxyType

from companion.mavlink.commands import Command
from companion.mavlink.messages import dialect
from companion.vehicle.ardupilot.parameters import ARDUPILOT_PARAMETERS
from companion.vehicle.autopilot import (
    FLIGHT_RATES,
    ControlEntry,
    OffboardLossFailsafe,
    Readiness,
    Role,
)

_ARMED_FLAG = dialect.MAV_MODE_FLAG_SAFETY_ARMED
_GUIDED_FLAG = dialect.MAV_MODE_FLAG_GUIDED_ENABLED
_CUSTOM_MODE_ENABLED = 1.0
_REQUIRED_FLAGS = 0x1 | 0x2 | 0x4 | 0x10  # attitude, both velocities, absolute position
_NO_POSITION_FLAG = 0x80  # constant position mode: the estimator has no position measurement
_MODE_NAME_PREFIX = "COPTER_MODE_"

_MODES: dict[str, int] = {
    entry.name.removeprefix(_MODE_NAME_PREFIX): number
    for number, entry in dialect.enums["COPTER_MODE"].items()
    if number != dialect.COPTER_MODE_ENUM_END
}
_MODE_NAMES = {number: name for name, number in _MODES.items()}
_GUIDED_BY_RATES = "GUIDED (body rates)"
_ROLES_BY_MODE = {
    "GUIDED": frozenset({Role.TAKEOFF, Role.READY}),
    _GUIDED_BY_RATES: frozenset({Role.OFFBOARD}),
    "BRAKE": frozenset({Role.HOLD}),
    "LAND": frozenset({Role.LAND}),
}


class ArduPilot:
    """ArduCopter's `Autopilot`.

    GUIDED is the mode of both take-off and offboard control. The first setpoint ends the take-off,
    so no setpoint may be sent during the climb. The guided bit of `base_mode` shows which one is
    active: take-off, with the position controller (set), or control by body rates (clear).
    """

    name = "ArduPilot"
    mav_autopilot = 3
    modes: Mapping[str, int] = MappingProxyType(_MODES)
    ready_mode = "GUIDED"
    offboard_mode = "GUIDED"
    control_entry = ControlEntry.BY_FIRST_SETPOINT
    bytewise_parameters = False
    # ArduPilot sends only what is requested. It has no ODOMETRY, so estimator resets are not
    # counted.
    wanted_rates: Mapping[str, float] = MappingProxyType(
        {
            **FLIGHT_RATES,
            # The default is 1 Hz; a pilot's takeover must be noticed sooner.
            "HEARTBEAT": 10.0,
            # The target turns at up to 1 rad/s; between messages it is predicted.
            "ATTITUDE_TARGET": 50.0,
            "EKF_STATUS_REPORT": 5.0,
            "HOME_POSITION": 1.0,
            "HIGHRES_IMU": 50.0,  # the thrust is identified from the accelerometer
        }
    )
    interval_step_us = 1000
    rates_about_target_axes = True
    body_yaw_is_relative = True
    can_compensate_tilt = True
    modes_begin_level = False  # landings from a hover in wind of 3 m/s drifted by 0.01 and 0.03 m
    offboard_loss_failsafe = OffboardLossFailsafe(
        "GUID_TIMEOUT",
        "the vehicle levels and keeps its height, but drifts: it does not hold its position",
        brakes=False,
    )
    fence_text: str | None = " breached"  # AC_Fence.cpp, as in "Circle fence breached"
    cannot_arm_in = frozenset[Role]()
    parameters = ARDUPILOT_PARAMETERS

    def mode_name(self, base_mode: int, custom_mode: int) -> str:
        """Name of the mode in a heartbeat; GUIDED that obeys body rates has a name of its own."""
        name = _MODE_NAMES.get(custom_mode, f"mode {custom_mode}")
        obeys_rates = name == "GUIDED" and base_mode & _ARMED_FLAG and not base_mode & _GUIDED_FLAG
        return _GUIDED_BY_RATES if obeys_rates else name

    def roles(self, mode: str) -> frozenset[Role]:
        """What a mode is used for in a flight; empty if only the pilot or a failsafe uses it."""
        return _ROLES_BY_MODE.get(mode, frozenset())

    def set_mode(self, name: str) -> Command:
        """DO_SET_MODE with the mode's number. Raises `KeyError` for an unknown name."""
        return Command(dialect.MAV_CMD_DO_SET_MODE, _CUSTOM_MODE_ENABLED, float(self.modes[name]))

    def why_not_ready(self, readiness: Readiness) -> str | None:
        """What is missing: estimator, position, home or ArduPilot's own pre-arm checks.

        ArduPilot boots in STABILIZE, whose pre-arm checks need no position, but GUIDED needs one.
        """
        flags = readiness.estimator_flags
        if flags is None:
            return "the estimator's status (EKF_STATUS_REPORT)"
        if flags & _REQUIRED_FLAGS != _REQUIRED_FLAGS or flags & _NO_POSITION_FLAG:
            return f"the estimator (EKF_STATUS_REPORT flags 0x{flags:x})"
        if not readiness.has_position:
            return "a local position (LOCAL_POSITION_NED)"
        if not readiness.has_home:
            return "the home position (HOME_POSITION)"
        if not readiness.prearm_passed:
            return "the autopilot's pre-arm checks"
        return None

    def take_off(self, height_m: float, home_altitude_m: float) -> Command:
        """Command that takes off here, to a height above home (m)."""
        return Command(dialect.MAV_CMD_NAV_TAKEOFF, p7=height_m)

    def hold(self) -> Command:
        """Command for BRAKE, which stops and holds; LOITER would follow the pilot's sticks."""
        return self.set_mode("BRAKE")

    def land(self) -> Command:
        """Command that lands here."""
        return self.set_mode("LAND")
