"""ArduCopter's parameters that matter to a flight by body rates.

Sources: the parameter reference; ArduCopter 4.7 in simulation, 2025 ("measured"). Version 4.7
renamed some parameters; a new name with another unit or meaning has its own rule.
"""

from companion.vehicle.parameter_checks import (
    INEFFECTIVE,
    UNSAFE,
    acceleration_limit,
    at_most,
    battery_scaling,
    bit_clear,
    bit_set,
    forbidden,
    hover_thrust,
    positive,
    rate_hold,
    required,
    system_id,
    thrust_curve,
)
from companion.vehicle.parameter_rules import CompanionSettings, ParameterRule, Problem, Values

_REFERENCE = "ArduCopter parameter reference"
_MEASURED = "measured on ArduCopter 4.7, 2025"
_STOPS_MOTORS = "the motors stop in the air"


def _angle_boost(value: float, _: Values, settings: CompanionSettings) -> Problem | None:
    if value and not settings.autopilot_compensates_tilt:
        return Problem(
            UNSAFE,
            "both ArduPilot and companion divide thrust by cos(tilt), so the vehicle climbs when "
            "it tilts (thrust.autopilot_compensates_tilt is false)",
            0.0,
        )
    if not value and settings.autopilot_compensates_tilt:
        return Problem(
            UNSAFE,
            "neither ArduPilot nor companion divides thrust by cos(tilt), so the vehicle sinks "
            "when it tilts; set thrust.autopilot_compensates_tilt to false",
        )
    return None


def _transmitter_failsafe(value: float, values: Values, _: CompanionSettings) -> Problem | None:
    if value or values.get("FS_GCS_ENABLE"):
        return None
    return Problem(
        UNSAFE,
        "ArduPilot does nothing when the pilot's transmitter is lost, and nothing when the ground "
        "station is lost (FS_GCS_ENABLE)",
        1.0,
    )


def _ground_station(value: float, values: Values, settings: CompanionSettings) -> Problem | None:
    if value != settings.source_system or not values.get("FS_GCS_ENABLE"):
        return None
    return Problem(
        INEFFECTIVE,
        f"companion's own heartbeat, of system {settings.source_system}, counts as the ground "
        "station's, so ArduPilot does not notice that the ground station is lost",
        255.0 if settings.source_system != 255 else None,
    )


def _loop_rate(value: float, _: Values, settings: CompanionSettings) -> Problem | None:
    if value >= settings.attitude_rate_hz:
        return None
    fact = f"the main loop is slower than link.attitude_rate_hz {settings.attitude_rate_hz:g}"
    return Problem(INEFFECTIVE, f"{fact}, so this rate is refused; lower link.attitude_rate_hz")


def _fence(value: float, values: Values, _: CompanionSettings) -> Problem | None:
    if value or not values.get("FENCE_ENABLE"):
        return None
    return Problem(INEFFECTIVE, "the fence (FENCE_ENABLE) only reports a breach", 1.0)


def _any_value(_: float, __: Values, ___: CompanionSettings) -> None:
    """Accept every value: the parameter is read only because `_fence` uses it."""


def _battery_failsafe(value: float, values: Values, _: CompanionSettings) -> Problem | None:
    if value == 5.0:
        return Problem(UNSAFE, _STOPS_MOTORS, 1.0)
    if value or values.get("BATT_FS_LOW_ACT"):
        return None
    return Problem(
        INEFFECTIVE,
        "ArduPilot does nothing about an empty battery; if companion ends, nothing lands the "
        "vehicle",
        set_to=1.0,
    )


def _acceleration_rules(axis: str, name: str) -> tuple[ParameterRule, ParameterRule]:
    meaning = f"how quickly the {name} rate may change"
    return (
        ParameterRule((f"ATC_ACC_{axis}_MAX",), meaning, acceleration_limit(1.0, name), _MEASURED),
        ParameterRule(
            (f"ATC_ACCEL_{axis}_MAX",),
            f"{meaning}, centidegrees/s² (before 4.7)",
            acceleration_limit(0.01, name),
            _REFERENCE,
        ),
    )


ARDUPILOT_PARAMETERS: tuple[ParameterRule, ...] = (
    ParameterRule(
        ("GUID_OPTIONS",),
        "whether ArduPilot takes the thrust of a setpoint as thrust or as climb rate",
        bit_set(
            UNSAFE, 8, "thrust would be obeyed as a climb rate (bit 3, value 8, makes it thrust)"
        ),
        f"{_REFERENCE}; {_MEASURED}",
        vital=True,
    ),
    ParameterRule(
        ("ATC_ANGLE_BOOST",),
        "whether ArduPilot divides thrust by cos(tilt)",
        _angle_boost,
        _MEASURED,
        vital=True,
    ),
    ParameterRule(
        ("GUID_TIMEOUT",), "for how long the last rates are held", rate_hold, _MEASURED, vital=True
    ),
    ParameterRule(
        ("ATC_RATE_FF_ENAB",),
        "whether body rates are fed forward",
        required(INEFFECTIVE, 1.0, "body rates are followed late, only through the attitude"),
        _REFERENCE,
    ),
    ParameterRule(
        ("ATC_INPUT_TC",),
        "how softly ArduPilot levels by itself",
        at_most(INEFFECTIVE, 0.3, "levelling takes long when setpoints stop", 0.15),
        _REFERENCE,
    ),
    *_acceleration_rules("R", "roll"),
    *_acceleration_rules("P", "pitch"),
    *_acceleration_rules("Y", "yaw"),
    ParameterRule(
        ("FS_GCS_ENABLE",),
        "what ArduPilot does when the ground station's heartbeat stops",
        forbidden(INEFFECTIVE, {2.0: "removed in 4.0; its effect depends on the version"}, 1.0),
        f"{_REFERENCE}; {_MEASURED}",
    ),
    ParameterRule(
        ("MAV_GCS_SYSID", "SYSID_MYGCS"),
        "whose heartbeat counts as the ground station's",
        _ground_station,
        _MEASURED,
    ),
    ParameterRule(
        ("MAV_SYSID", "SYSID_THISMAV"), "the vehicle's system id", system_id, "MAVLink routing"
    ),
    ParameterRule(
        ("FS_THR_ENABLE",),
        "what ArduPilot does when the pilot's transmitter is lost",
        _transmitter_failsafe,
        _REFERENCE,
        in_all_versions=True,
    ),
    ParameterRule(
        ("FS_OPTIONS",),
        "in which modes failsafes are ignored",
        bit_clear(INEFFECTIVE, 4, "in GUIDED nothing is done about a lost transmitter"),
        _REFERENCE,
    ),
    ParameterRule(
        ("FLTMODE_GCSBLOCK",),
        "which modes ArduPilot lets nobody command over MAVLink",
        bit_clear(INEFFECTIVE, 4096, "BRAKE (4096) is refused: a vehicle asked to hold lands"),
        _REFERENCE,
    ),
    ParameterRule(("MOT_THST_HOVER",), "at which thrust ArduPilot hovers", hover_thrust, _MEASURED),
    ParameterRule(
        ("MOT_THST_EXPO",),
        "whether ArduPilot compensates the thrust curve",
        thrust_curve,
        _REFERENCE,
    ),
    ParameterRule(
        ("MOT_BAT_VOLT_MAX",),
        "whether ArduPilot compensates the battery voltage (0: it does not)",
        battery_scaling,
        _REFERENCE,
    ),
    ParameterRule(
        ("ARMING_SKIPCHK",),
        "which checks before arming are left out",
        required(UNSAFE, 0.0, "checks before arming are left out"),
        _REFERENCE,
        in_all_versions=True,
        alternative="ARMING_CHECK",
    ),
    ParameterRule(
        ("ARMING_CHECK",),
        "which checks before arming are made (before 4.7)",
        required(UNSAFE, 1.0, "not all checks are made before arming"),
        _REFERENCE,
    ),
    ParameterRule(
        ("DISARM_DELAY",),
        "after how long on the ground ArduPilot disarms itself",
        positive(UNSAFE, "a vehicle that was armed and does not take off stays armed", 10.0),
        _REFERENCE,
        in_all_versions=True,
    ),
    ParameterRule(
        ("SCHED_LOOP_RATE",), "how often ArduPilot's main loop runs, Hz", _loop_rate, _MEASURED
    ),
    ParameterRule(
        ("FS_EKF_ACTION",),
        "what ArduPilot does when its estimator fails",
        forbidden(
            UNSAFE,
            {
                0.0: "ArduPilot only reports that the vehicle does not know where it is",
                2.0: "ArduPilot goes to ALT_HOLD, and drifts unless a pilot acts at once",
            },
            1.0,
        ),
        _REFERENCE,
        in_all_versions=True,
    ),
    ParameterRule(("FENCE_ACTION",), "what ArduPilot does at its own geofence", _fence, _REFERENCE),
    ParameterRule(
        ("FENCE_ENABLE",), "whether ArduPilot has a geofence of its own", _any_value, _REFERENCE
    ),
    ParameterRule(
        ("BATT_FS_LOW_ACT",),
        "what ArduPilot does about a low battery",
        forbidden(UNSAFE, {5.0: _STOPS_MOTORS}, 2.0),
        _REFERENCE,
        in_all_versions=True,
    ),
    ParameterRule(
        ("BATT_FS_CRT_ACT",),
        "what ArduPilot does about a nearly empty battery",
        _battery_failsafe,
        _REFERENCE,
        in_all_versions=True,
    ),
)
