"""ArduCopter's numbers for its modes, and what each needs."""

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
NEEDS_POSITION = frozenset({Mode.GUIDED, Mode.LOITER, Mode.RTL, Mode.BRAKE})
"""Modes that need a horizontal position."""
NOT_ARMABLE = frozenset({Mode.RTL, Mode.LAND, Mode.BRAKE})

PILOT_MODES = {
    Mode.POSCTL: Mode.LOITER,
    Mode.ALTCTL: Mode.ALT_HOLD,
    Mode.STABILIZED: Mode.STABILIZE,
    Mode.MANUAL: Mode.STABILIZE,
}
"""PX4's words for what a pilot switches to -> ArduCopter's."""
PILOTED = frozenset({Mode.STABILIZE, Mode.ALT_HOLD, Mode.LOITER})
"""Modes that a pilot flies."""


def base_mode(*, armed: bool, position_controlled: bool) -> int:
    """Return HEARTBEAT.base_mode: 81, with 8 while a horizontal position is held, and 128 armed.

    So 209 while rates fly in GUIDED, and 217 when it holds its position (recorded).
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
    refusal: str | None,
) -> str | None:
    """Return why arming is refused now, None if it is not.

    Args:
        state: the autopilot's state.
        initialised: whether the autopilot has said that it is ready.
        home_set: whether the estimator has settled on its origin.
        crashed: whether the vehicle is broken.
        gcs_failsafe: whether the ground station is lost.
        refusal: a reason given from outside (fault injection).
    """
    mode: Mode = state.mode
    problems = (
        (not initialised, "System not initialised"),
        (refusal is not None, refusal),
        (crashed, "Vehicle has crashed"),
        (not home_set, "AHRS: waiting for home"),
        (mode in NEEDS_POSITION and not state.position_valid, "Need Position Estimate"),
        (mode in NOT_ARMABLE, "Mode not armable"),
        (state.battery_warning > BatteryWarning.OK, "Battery failsafe on"),
        (gcs_failsafe, "GCS failsafe on"),
    )
    return next((problem for present, problem in problems if present), None)
