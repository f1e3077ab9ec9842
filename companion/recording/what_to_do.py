"""Advice after a flight that ended early, by the monitor or the phase that ended it."""

from collections.abc import Mapping

from companion.user_code import MESSAGE_START

ADVICE_BY_MONITOR: Mapping[str, str] = {
    "unheard": "check cable, radio and power: the vehicle was not heard any more",
    "silence": "fix the cause named above: telemetry, invalid values in it, or this computer",
    "frozen": "find what repeats old telemetry: a relay, a bridge, or the autopilot's estimator",
    "clock": "find why the autopilot restarted or its clock jumped; check its power supply",
    "disarmed": "find who disarmed the vehicle in flight: the pilot's switch or the autopilot",
    "landed": "check the autopilot's land detector, which reported the ground, or fly higher",
    "failsafe": "fix what the autopilot's failsafe names in the events",
    "battery": "charge the battery; the limit is limits.min_battery_percent",
    "gps": "wait for a better GPS fix, or fly where more of the sky is seen",
    "estimator": "let the autopilot's estimator settle; check its sensors and calibration",
    "reset": "check GPS and compass: the autopilot's estimate jumped",
    "resets": "check GPS and compass; the limits are safety.max_reset_m, max_reset_deg, max_resets",
    "heading": "check the compass: its calibration, and currents and metal near it",
    "height": "check the barometer: its foam, and wind or light that reaches it",
    "tilt": "find what tilted the vehicle beyond limits.max_tilt_deg: wind, a collision, a motor; "
    "if it swung more and more, lower planner.gain_per_s, then run `companion identify`",
    "body rate": "check the autopilot's rate loop; the limit is safety.max_body_rate_deg_s",
    "fence": "make the maneuver smaller, fly in less wind, or widen the fence: limits.fence_*",
    "braking": "make the maneuver smaller or slower, or widen the fence: limits.fence_*",
    "speed": "fly slower; the limit is safety.max_speed_m_s",
    "tracking": "fly slower or in less wind; check the compass if the vehicle flew in curves that "
    "grew; the limit is safety.max_tracking_error_m",
    "thrust": "carry less or fly in less wind; the limits are limits.min_thrust and max_thrust",
    "answer gaps": "find what interrupts the telemetry or this computer",
    "answer rate": "find what slows ATTITUDE_QUATERNION; the limit is link.min_attitude_rate_hz",
    "position rate": "find what slows LOCAL_POSITION_NED; the limit is link.min_position_rate_hz",
    "late setpoints": "find what slows the link; the limit is 1.5 · deadman.telemetry_stale_ms",
    "lost setpoints": "find what loses the frames that this computer sends: the cable, the radio",
    "foreign setpoints": "end the other program that sends SET_ATTITUDE_TARGET to this vehicle; if "
    "there is none, a station may have changed a parameter in flight: run `companion doctor`",
    "rare setpoint": "end the other program or station that commands this vehicle",
    "link loss": "improve the radio link or lower its load; the limit is safety.max_loss",
    "round trip": "find what slows the link; the limit is safety.max_round_trip_ms",
    "deadlines": "end other programs on this computer, or set realtime.scheduler: fifo",
    "starvation": "end other programs on this computer, or set realtime.scheduler: fifo",
}

ADVICE_BY_PHASE: Mapping[str, str] = {
    "connect": "check power, cable and link.endpoint; nothing else may use the same port",
    "checks": "fix what the message names; `companion doctor` explains each check",
    "stream": "check the link: the autopilot sent too few attitude samples to begin the setpoints",
    "arm": "fix what the autopilot names in the events; --arm lets the program arm",
    "hand over": "fly at flight.takeoff_height_m or higher, and switch to the mode that holds",
    "takeoff": "read the autopilot's messages in the events; the pilot may have taken over",
    "offboard": "fix what the message names; read the autopilot's messages in the events",
    "maneuvers": "read the events before the end; if the pilot took over, nothing needs fixing",
    "hand back": "read the events before the end; the pilot may have taken over",
    "listen": ADVICE_BY_MONITOR["unheard"],
    "land": "read the events before the end; the pilot may have taken over",
    "disarm": "if the vehicle is still armed, disarm it by the pilot's switch; read the events "
    "before the end",
}

_RESTARTED = "the autopilot may have restarted"
_USER_CODE = "fix the code named above, and fly it on the mock vehicle (`companion demo`) first"


def what_to_do(monitor: str | None, phase: str, result: str = "") -> str:
    """Advice as one sentence without a full stop.

    The advice depends on the monitor that ended the flight (None: no monitor), else on the phase
    that failed; an error in the user's code, or a restart, named in `result`, has its own advice.
    """
    if result.startswith(MESSAGE_START):
        return _USER_CODE
    if result.startswith(_RESTARTED):
        return ADVICE_BY_MONITOR["clock"]
    if monitor is not None:
        plugin_advice = f"fix what your own monitor `{monitor}` reported, or change its limit"
        return ADVICE_BY_MONITOR.get(monitor, plugin_advice)
    return ADVICE_BY_PHASE.get(phase, "read the events before the end")
