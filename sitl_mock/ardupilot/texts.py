"""ArduCopter's words. It has no events, and keeps what is missing here to itself."""

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.autopilot.personality import Event, Occasion

INFO = dialect.MAV_SEVERITY_INFO
WARNING = dialect.MAV_SEVERITY_WARNING
CRITICAL = dialect.MAV_SEVERITY_CRITICAL

ARDUPILOT_EVENTS: dict[Occasion, Event] = {
    Occasion.ARMED: Event("Arming motors", INFO),
    Occasion.ARMING_DENIED: Event("Arm: {}", CRITICAL),
    Occasion.PREFLIGHT_FAIL: Event("PreArm: {}", CRITICAL),
    Occasion.DISARMED_BY_COMMAND: Event("Disarming motors", INFO),
    Occasion.DISARMED_BY_LANDING: Event("Disarming motors", INFO),
    Occasion.DISARMED_ON_GROUND: Event("Disarming motors", INFO),
    Occasion.DISARMED_AFTER_CRASH: Event("Crash: Disarming", CRITICAL),
    Occasion.MODE_DENIED: Event("Mode change to {} failed: requires position", WARNING),
    Occasion.GCS_LOST: Event("GCS Failsafe", WARNING),
    Occasion.GCS_REGAINED: Event("GCS Failsafe Cleared", WARNING),
    Occasion.POSITION_LOST: Event("EKF Failsafe: changed to LAND Mode", CRITICAL),
    Occasion.BATTERY_LOW: Event("Battery 1 is low {}", WARNING),
    Occasion.BATTERY_CRITICAL: Event("Battery 1 is critical {}", CRITICAL),
}
