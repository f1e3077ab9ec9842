"""ArduCopter's modes: their numbers, what each needs, and what forbids arming."""

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.autopilot.state import BatteryWarning, Mode, State

MODE_NUMBERS: dict[Mode, int] = {
    Mode.STABILIZE: 0,
    Mode.ALT_HOLD: 2,
    Mode.GUIDED: 4,
    Mode.LOITER: 5,
    Mode.RTL: 6,
    Mode.LAND: 9,
    Mode.BRAKE: 17,
}
"""HEARTBEAT.custom_mode of each mode."""
MODES_BY_NUMBER = {number: mode for mode, number in MODE_NUMBERS.items()}
POSITION_MODES = frozenset({Mode.GUIDED, Mode.LOITER, Mode.RTL, Mode.BRAKE})
"""Modes that need a horizontal position."""
UNARMABLE_MODES = frozenset({Mode.RTL, Mode.LAND, Mode.BRAKE})
"""Modes in which ArduCopter cannot be armed."""

MODE_FOR_PX4_MODE = {
    Mode.POSCTL: Mode.LOITER,
    Mode.ALTCTL: Mode.ALT_HOLD,
    Mode.STABILIZED: Mode.STABILIZE,
    Mode.MANUAL: Mode.STABILIZE,
}
"""Pilot's mode of PX4 -> the corresponding mode of ArduCopter."""
PILOTED_MODES = frozenset({Mode.STABILIZE, Mode.ALT_HOLD, Mode.LOITER})


def base_mode(*, armed: bool, position_controlled: bool) -> int:
    """Return HEARTBEAT.base_mode: 81, plus 8 in horizontal position control, plus 128 if armed.

    Armed: 209 while GUIDED follows body rates, 217 in a position hold (recorded).
    """
    flags = (
        dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        | dialect.MAV_MODE_FLAG_STABILIZE_ENABLED
        | dialect.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED
    )
    if position_controlled:
        flags |= dialect.MAV_MODE_FLAG_GUIDED_ENABLED
    if armed:
        flags |= dialect.MAV_MODE_FLAG_SAFETY_ARMED
    return int(flags)


def arming_problem(
    state: State,
    *,
    initialised: bool,
    home_set: bool,
    crashed: bool,
    gcs_failsafe: bool,
    arming_refusal: str | None,
) -> str | None:
    """Return why arming is refused now, in ArduCopter's words; None if it is allowed.

    ``arming_refusal`` is the reason of an active `RefuseArming` fault; ``initialised``: see `Boot`.
    """
    mode: Mode = state.mode
    problems = (
        (not initialised, "System not initialised"),
        (arming_refusal is not None, arming_refusal),
        (crashed, "Vehicle has crashed"),
        (not home_set, "AHRS: waiting for home"),
        (mode in POSITION_MODES and not state.position_valid, "Need Position Estimate"),
        (mode in UNARMABLE_MODES, "Mode not armable"),
        (state.battery_warning > BatteryWarning.OK, "Battery failsafe on"),
        (gcs_failsafe, "GCS failsafe on"),
    )
    return next((problem for applies, problem in problems if applies), None)
