"""PX4: its mode numbers, the messages to request from it, and its commands.

Sources: PX4's `px4_custom_mode.h` and `commander`. The figures were measured on PX4 main in
simulation, 2026.
"""

from collections.abc import Mapping
from math import nan
from types import MappingProxyType

from companion.mavlink.commands import Command
from companion.mavlink.messages import dialect
from companion.vehicle.autopilot import (
    FLIGHT_RATES,
    ControlEntry,
    OffboardLossFailsafe,
    Readiness,
    Role,
)
from companion.vehicle.px4.parameters import PX4_PARAMETERS

_REQUIRED_FLAGS = 0x1 | 0x2 | 0x4 | 0x8  # attitude, both velocities, horizontal position
_CUSTOM_MODE_ENABLED = 1.0
_AUTO_MAIN_MODE = 4


def _custom_mode(main: int, sub: int = 0) -> int:
    return main << 16 | sub << 24


_MODES = {
    "MANUAL": _custom_mode(1),
    "ALTCTL": _custom_mode(2),
    "POSCTL": _custom_mode(3),
    "AUTO.READY": _custom_mode(_AUTO_MAIN_MODE, 1),
    "AUTO.TAKEOFF": _custom_mode(_AUTO_MAIN_MODE, 2),
    "AUTO.LOITER": _custom_mode(_AUTO_MAIN_MODE, 3),
    "AUTO.MISSION": _custom_mode(_AUTO_MAIN_MODE, 4),
    "AUTO.RTL": _custom_mode(_AUTO_MAIN_MODE, 5),
    "AUTO.LAND": _custom_mode(_AUTO_MAIN_MODE, 6),
    "AUTO.FOLLOW": _custom_mode(_AUTO_MAIN_MODE, 8),
    "AUTO.PRECLAND": _custom_mode(_AUTO_MAIN_MODE, 9),
    "ACRO": _custom_mode(5),
    "OFFBOARD": _custom_mode(6),
    "STABILIZED": _custom_mode(7),
}
_DESCEND_MODE = "AUTO.DESCEND"
"""Mode in which PX4's failsafe lands without a position; it cannot be commanded. PX4 changes from
AUTO.LAND to this mode 4.8 s after GPS is lost (measured)."""
_MODE_NAMES = {number: name for name, number in _MODES.items()} | {
    _custom_mode(_AUTO_MAIN_MODE, 20): _DESCEND_MODE
}
_ROLES_BY_MODE = {
    "AUTO.TAKEOFF": frozenset({Role.TAKEOFF, Role.READY}),
    "AUTO.LOITER": frozenset({Role.HOLD, Role.READY}),
    "OFFBOARD": frozenset({Role.OFFBOARD}),
    "AUTO.LAND": frozenset({Role.LAND}),
    _DESCEND_MODE: frozenset({Role.LAND}),
}


class Px4:
    """PX4's `Autopilot`.

    OFFBOARD can be entered after setpoints have streamed at 2 Hz or more for a second. When
    setpoints stop, PX4 holds the last rates for COM_OF_LOSS_T, so the last setpoint must command
    zero rates. While the intended mode is OFFBOARD, PX4 enters OFFBOARD again at a later setpoint;
    only a mode command releases control for good.
    """

    name = "PX4"
    mav_autopilot = 12
    modes: Mapping[str, int] = MappingProxyType(_MODES)
    ready_mode = "AUTO.LOITER"
    offboard_mode = "OFFBOARD"
    control_entry = ControlEntry.BY_COMMAND
    bytewise_parameters = True
    # PX4 rounds the interval to its inner loop. For 250 Hz, a 250 Hz loop gives 197 Hz and an
    # 800 Hz loop 196 Hz; for 400 Hz they give 191 and 392 Hz.
    wanted_rates: Mapping[str, float] = MappingProxyType(
        {
            **FLIGHT_RATES,
            # PX4 sends HEARTBEAT at 1 Hz whatever is requested (ACK 4). CURRENT_MODE comes at 2 Hz,
            # and within 65 ms of a change of mode, arming or failsafe; PX4 1.14 does not have it.
            "CURRENT_MODE": 20.0,
            "ESTIMATOR_STATUS": 5.0,
            "HOME_POSITION": 1.0,
            "ODOMETRY": 10.0,
        }
    )
    interval_step_us = 1
    rates_about_target_axes = False
    body_yaw_is_relative = False
    can_compensate_tilt = False
    modes_begin_level = True
    offboard_loss_failsafe = OffboardLossFailsafe(
        "COM_OF_LOSS_T", "PX4 takes the action that COM_OBL_RC_ACT sets", brakes=True
    )
    fence_text: str | None = None
    cannot_arm_in = frozenset({Role.OFFBOARD, Role.LAND})
    parameters = PX4_PARAMETERS

    def mode_name(self, base_mode: int, custom_mode: int) -> str:
        """Name of the mode in a heartbeat; PX4's depends only on `custom_mode`."""
        return _MODE_NAMES.get(custom_mode, f"mode 0x{custom_mode:08x}")

    def roles(self, mode: str) -> frozenset[Role]:
        """What a mode is used for in a flight; empty if only the pilot or a failsafe uses it."""
        return _ROLES_BY_MODE.get(mode, frozenset())

    def set_mode(self, name: str) -> Command:
        """DO_SET_MODE with PX4's main and sub mode. Raises `KeyError` for an unknown name."""
        number = self.modes[name]
        main, sub = number >> 16 & 0xFF, number >> 24 & 0xFF
        return Command(dialect.MAV_CMD_DO_SET_MODE, _CUSTOM_MODE_ENABLED, float(main), float(sub))

    def why_not_ready(self, readiness: Readiness) -> str | None:
        """What is missing: position, estimator, home or PX4's own pre-arm checks."""
        if not readiness.has_position:
            return "a local position (LOCAL_POSITION_NED)"
        if readiness.estimator_flags is None:
            return "the estimator's status (ESTIMATOR_STATUS)"
        if readiness.estimator_flags & _REQUIRED_FLAGS != _REQUIRED_FLAGS:
            return f"the estimator (ESTIMATOR_STATUS flags 0x{readiness.estimator_flags:x})"
        if not readiness.has_home:
            return "the home position (HOME_POSITION)"
        if not readiness.prearm_passed:
            return "the autopilot's pre-arm checks"
        return None

    def take_off(self, height_m: float, home_altitude_m: float) -> Command:
        """Command that takes off here, to a height above home (m), and keeps the heading (NaN)."""
        altitude = home_altitude_m + height_m
        return Command(dialect.MAV_CMD_NAV_TAKEOFF, p4=nan, p5=nan, p6=nan, p7=altitude)

    def hold(self) -> Command:
        """Command that enters AUTO.LOITER."""
        return self.set_mode("AUTO.LOITER")

    def land(self) -> Command:
        """Command that lands here and keeps the heading."""
        return Command(dialect.MAV_CMD_NAV_LAND, p4=nan, p5=nan, p6=nan)
