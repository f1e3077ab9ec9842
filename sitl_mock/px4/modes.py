"""PX4's mode numbers in HEARTBEAT and CURRENT_MODE (recorded from PX4 main)."""

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.autopilot.state import Mode

_ARMED = dialect.MAV_MODE_FLAG_SAFETY_ARMED
_MANUAL = dialect.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED
_STABILIZE = dialect.MAV_MODE_FLAG_STABILIZE_ENABLED
_GUIDED = dialect.MAV_MODE_FLAG_GUIDED_ENABLED
_AUTO = dialect.MAV_MODE_FLAG_AUTO_ENABLED
_CUSTOM = dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED

MAIN_AUTO = 4

MODE_NUMBERS: dict[Mode, tuple[int, int]] = {
    Mode.MANUAL: (1, 0),
    Mode.ALTCTL: (2, 0),
    Mode.POSCTL: (3, 0),
    Mode.TAKEOFF: (MAIN_AUTO, 2),
    Mode.LOITER: (MAIN_AUTO, 3),
    Mode.RTL: (MAIN_AUTO, 5),
    Mode.LAND: (MAIN_AUTO, 6),
    Mode.OFFBOARD: (6, 0),
    Mode.STABILIZED: (7, 0),
}
"""(main mode, sub mode) of each mode; bytes 2 and 3 of custom_mode."""

_STANDARD_MODES = {
    Mode.ALTCTL: dialect.MAV_STANDARD_MODE_ALTITUDE_HOLD,
    Mode.POSCTL: dialect.MAV_STANDARD_MODE_POSITION_HOLD,
    Mode.RTL: dialect.MAV_STANDARD_MODE_SAFE_RECOVERY,
    Mode.LAND: dialect.MAV_STANDARD_MODE_LAND,
    Mode.TAKEOFF: dialect.MAV_STANDARD_MODE_TAKEOFF,
}

PILOTED_MODES = frozenset({Mode.MANUAL, Mode.ALTCTL, Mode.POSCTL, Mode.STABILIZED})
"""Modes that need a pilot's sticks."""

POSITION_MODES = frozenset({Mode.POSCTL, Mode.LOITER, Mode.TAKEOFF, Mode.RTL})
"""Modes that need a horizontal position."""

MODES_BY_COMMAND: dict[tuple[int, int], Mode] = {
    numbers: mode for mode, numbers in MODE_NUMBERS.items()
}
"""(main mode, sub mode) of DO_SET_MODE -> mode."""


def custom_mode(mode: Mode) -> int:
    """Return HEARTBEAT.custom_mode: main mode << 16 | sub mode << 24."""
    main, sub = MODE_NUMBERS[mode]
    return main << 16 | sub << 24


def base_mode(mode: Mode, *, armed: bool, attitude_controlled: bool) -> int:
    """Return HEARTBEAT.base_mode (recorded): 29 in automatic modes, 81 in a pilot's modes.

    In OFFBOARD: 1 while PX4 follows body rates, else 17. Arming adds 128.
    """
    flags = _CUSTOM | (_ARMED if armed else 0)
    if mode is Mode.OFFBOARD:
        return int(flags | (_STABILIZE if attitude_controlled else 0))
    if MODE_NUMBERS[mode][0] == MAIN_AUTO:
        return int(flags | _STABILIZE | _GUIDED | _AUTO)
    return int(flags | _STABILIZE | _MANUAL)


def standard_mode(mode: Mode) -> int:
    """Return CURRENT_MODE.standard_mode (MAV_STANDARD_MODE), 0 if there is none."""
    return int(_STANDARD_MODES.get(mode, dialect.MAV_STANDARD_MODE_NON_STANDARD))
