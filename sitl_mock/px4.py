"""PX4's numbers and words: modes, stream rates, identity, events (recorded from PX4 main, SIH)."""

from collections.abc import Mapping

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.modes import Mode
from sitl_mock.parameters import Parameter
from sitl_mock.personality import Event, Identity, Occasion
from sitl_mock.px4_events import PX4_EVENTS
from sitl_mock.px4_parameters import PX4_PARAMETERS

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
"""(main mode, sub mode) of each mode; custom_mode carries them in bytes 2 and 3."""

_STANDARD_MODES = {
    Mode.ALTCTL: dialect.MAV_STANDARD_MODE_ALTITUDE_HOLD,
    Mode.POSCTL: dialect.MAV_STANDARD_MODE_POSITION_HOLD,
    Mode.RTL: dialect.MAV_STANDARD_MODE_SAFE_RECOVERY,
    Mode.LAND: dialect.MAV_STANDARD_MODE_LAND,
    Mode.TAKEOFF: dialect.MAV_STANDARD_MODE_TAKEOFF,
}

_COMPANION_RATES: dict[int, float] = {
    dialect.MAVLINK_MSG_ID_HEARTBEAT: 1.0,
    dialect.MAVLINK_MSG_ID_ATTITUDE: 100.0,
    dialect.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: 50.0,
    dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 50.0,
    dialect.MAVLINK_MSG_ID_HIGHRES_IMU: 50.0,
    dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 30.0,
    dialect.MAVLINK_MSG_ID_ODOMETRY: 30.0,
    dialect.MAVLINK_MSG_ID_TIMESYNC: 10.0,
    dialect.MAVLINK_MSG_ID_ALTITUDE: 10.0,
    dialect.MAVLINK_MSG_ID_ATTITUDE_TARGET: 10.0,
    dialect.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED: 10.0,
    dialect.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: 10.0,
    dialect.MAVLINK_MSG_ID_VFR_HUD: 10.0,
    dialect.MAVLINK_MSG_ID_GPS_RAW_INT: 8.0,
    dialect.MAVLINK_MSG_ID_SYS_STATUS: 5.0,
    dialect.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: 5.0,
    dialect.MAVLINK_MSG_ID_ESTIMATOR_STATUS: 1.0,
    dialect.MAVLINK_MSG_ID_SYSTEM_TIME: 1.0,
    dialect.MAVLINK_MSG_ID_PING: 1.0,
    dialect.MAVLINK_MSG_ID_MISSION_CURRENT: 1.0,
    dialect.MAVLINK_MSG_ID_BATTERY_STATUS: 0.5,
    dialect.MAVLINK_MSG_ID_HOME_POSITION: 0.5,
    dialect.MAVLINK_MSG_ID_CURRENT_MODE: 0.5,
    dialect.MAVLINK_MSG_ID_VIBRATION: 0.5,
}

_GCS_RATES: dict[int, float] = {
    **_COMPANION_RATES,
    dialect.MAVLINK_MSG_ID_ATTITUDE: 15.0,
    dialect.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: 10.0,
    dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 10.0,
    dialect.MAVLINK_MSG_ID_HIGHRES_IMU: 1.0,
    dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 10.0,
    dialect.MAVLINK_MSG_ID_ODOMETRY: 1.0,
    dialect.MAVLINK_MSG_ID_TIMESYNC: 1.0,
    dialect.MAVLINK_MSG_ID_ALTITUDE: 2.0,
    dialect.MAVLINK_MSG_ID_ATTITUDE_TARGET: 2.0,
    dialect.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED: 2.0,
    dialect.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: 2.0,
    dialect.MAVLINK_MSG_ID_VFR_HUD: 4.0,
    dialect.MAVLINK_MSG_ID_GPS_RAW_INT: 1.0,
    dialect.MAVLINK_MSG_ID_SYS_STATUS: 1.0,
    dialect.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: 1.0,
}


class Px4:
    """The PX4 personality."""

    autopilot_type: int = dialect.MAV_AUTOPILOT_PX4
    identity = Identity(
        capabilities=0xE8FF,
        flight_sw_version=18022464,
        middleware_sw_version=18022464,
        os_sw_version=101854463,
        flight_custom_version=(0, 0, 0, 245, 216, 154, 203, 253),
    )
    modes_by_command: Mapping[tuple[int, int], Mode] = {
        numbers: mode for mode, numbers in MODE_NUMBERS.items()
    }
    events: Mapping[Occasion, Event] = PX4_EVENTS

    def parameters(self) -> tuple[Parameter, ...]:
        """Return PX4's parameters."""
        return PX4_PARAMETERS

    def stream_rates(self, link: str) -> Mapping[int, float]:
        """Return the measured onboard rates, and lower ones for the ground station's link."""
        return _GCS_RATES if link == "gcs" else _COMPANION_RATES

    def custom_mode(self, mode: Mode) -> int:
        """Return main mode << 16 | sub mode << 24."""
        main, sub = MODE_NUMBERS[mode]
        return main << 16 | sub << 24

    def mode_of(self, custom_mode: int) -> Mode | None:
        """Return the mode of a custom_mode, None if the mock has none such."""
        return self.modes_by_command.get((custom_mode >> 16 & 0xFF, custom_mode >> 24 & 0xFF))

    def base_mode(self, mode: Mode, *, armed: bool, attitude_controlled: bool) -> int:
        """Return the recorded flags: 29 auto, 1 offboard by rates, 17 above rates, +128 armed."""
        flags = _CUSTOM | (_ARMED if armed else 0)
        if mode is Mode.OFFBOARD:
            return int(flags | (_STABILIZE if attitude_controlled else 0))
        if MODE_NUMBERS[mode][0] == MAIN_AUTO:
            return int(flags | _STABILIZE | _GUIDED | _AUTO)
        return int(flags | _STABILIZE | _MANUAL)

    def standard_mode(self, mode: Mode) -> int:
        """Return MAV_STANDARD_MODE, 0 for what has none."""
        return int(_STANDARD_MODES.get(mode, dialect.MAV_STANDARD_MODE_NON_STANDARD))
