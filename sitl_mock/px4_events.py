"""PX4's words and event ids. Ids and arguments with an id are as recorded; texts end in a tab."""

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.personality import Event, Occasion

_INFO = dialect.MAV_SEVERITY_INFO
_WARNING = dialect.MAV_SEVERITY_WARNING
_CRITICAL = dialect.MAV_SEVERITY_CRITICAL

PX4_EVENTS: dict[Occasion, Event] = {
    Occasion.ARMED: Event("Armed by external command\t", _INFO, 26266355, b"\x04"),
    Occasion.ARMING_DENIED: Event(
        "Arming denied: Resolve system health failures first\t", _CRITICAL, 16910493
    ),
    Occasion.PREFLIGHT_FAIL: Event("Preflight Fail: {}", _CRITICAL),
    Occasion.DISARMED_BY_COMMAND: Event("Disarmed by external command\t", _INFO, 32794487, b"\x04"),
    Occasion.DISARMED_BY_LANDING: Event("Disarmed by landing\t", _INFO, 32794487, b"\x06"),
    Occasion.DISARMED_ON_GROUND: Event(
        "Disarmed by auto preflight disarming\t", _INFO, 32794487, b"\x07"
    ),
    Occasion.DISARMED_AFTER_CRASH: Event("Disarmed by failure detector\t", _CRITICAL),
    Occasion.DISARM_DENIED: Event("Disarming denied: not landed\t", _CRITICAL),
    Occasion.MODE_DENIED: Event("Switching to mode '{}' is currently not possible\t", _CRITICAL),
    Occasion.DEFAULT_TAKEOFF_ALTITUDE: Event(
        "Using default takeoff altitude: {} m\t", _INFO, 20656071
    ),
    Occasion.TAKEOFF_DETECTED: Event("Takeoff detected\t", _INFO, 21054825),
    Occasion.LANDING_DETECTED: Event("Landing detected\t", _INFO, 26622124),
    Occasion.OFFBOARD_LOST: Event(
        "Failsafe activated: no offboard signal\t", _CRITICAL, 30054617, b"\x00\x00\x06"
    ),
    Occasion.OFFBOARD_REGAINED: Event("Offboard signal regained\t", _INFO),
    Occasion.GCS_LOST: Event("Connection to ground station lost\t", _WARNING),
    Occasion.COMPANION_LOST: Event("Connection to mission computer lost\t", _WARNING),
    Occasion.COMPANION_REGAINED: Event("Connection to mission computer regained\t", _INFO),
    Occasion.POSITION_LOST: Event("Failsafe activated: no valid position estimate\t", _CRITICAL),
    Occasion.BATTERY_LOW: Event("Low battery level, return advised\t", _WARNING),
    Occasion.BATTERY_CRITICAL: Event("Critical battery level, land now\t", _CRITICAL),
    Occasion.BATTERY_EMERGENCY: Event("Dangerously low battery, shut system down\t", _CRITICAL),
    Occasion.PILOT_LOST: Event("Failsafe activated: no manual control\t", _CRITICAL),
    Occasion.PILOT_TOOK_OVER: Event("Pilot took over using sticks\t", _CRITICAL),
}
