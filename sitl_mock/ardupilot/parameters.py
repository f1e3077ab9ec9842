"""ArduCopter's parameters that matter to a companion, with their types and defaults (SITL quad +).

Those marked * are obeyed by the mock; the others are there because clients read them, or because a
user expects to find them. Names are those of 4.7 where they were recorded.
"""

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.autopilot.parameters import Parameter

_INT8 = dialect.MAV_PARAM_TYPE_INT8
_INT16 = dialect.MAV_PARAM_TYPE_INT16
_INT32 = dialect.MAV_PARAM_TYPE_INT32
_REAL32 = dialect.MAV_PARAM_TYPE_REAL32

_PARAMETERS: tuple[tuple[str, int | float, int], ...] = (
    ("ANGLE_MAX", 3000, _INT16),  # * centidegrees
    ("ARMING_SKIPCHK", 0, _INT32),
    ("ATC_ACCEL_P_MAX", 110000.0, _REAL32),
    ("ATC_ACCEL_R_MAX", 110000.0, _REAL32),
    ("ATC_ACCEL_Y_MAX", 27000.0, _REAL32),
    ("ATC_ANGLE_BOOST", 1, _INT8),  # *
    ("ATC_ANG_PIT_P", 4.5, _REAL32),
    ("ATC_ANG_RLL_P", 4.5, _REAL32),
    ("ATC_ANG_YAW_P", 4.5, _REAL32),
    ("ATC_INPUT_TC", 0.15, _REAL32),
    ("ATC_RATE_FF_ENAB", 1, _INT8),
    ("BARO1_GND_PRESS", 94502.83, _REAL32),
    ("BATT_CAPACITY", 3300, _INT32),  # *
    ("BATT_CRT_MAH", 0.0, _REAL32),  # *
    ("BATT_CRT_VOLT", 0.0, _REAL32),  # *
    ("BATT_FS_CRT_ACT", 0, _INT8),  # *
    ("BATT_FS_LOW_ACT", 0, _INT8),  # *
    ("BATT_LOW_MAH", 0.0, _REAL32),  # *
    ("BATT_LOW_TIMER", 10, _INT8),  # *
    ("BATT_LOW_VOLT", 10.5, _REAL32),  # *
    ("BATT_MONITOR", 4, _INT8),
    ("COMPASS_DEV_ID", 97539, _INT32),
    ("DISARM_DELAY", 10, _INT8),  # *
    ("FENCE_ACTION", 1, _INT8),
    ("FENCE_ENABLE", 0, _INT8),
    ("FRAME_CLASS", 1, _INT8),
    ("FRAME_TYPE", 0, _INT8),
    ("FS_EKF_ACTION", 1, _INT8),  # *
    ("FS_EKF_THRESH", 0.8, _REAL32),
    ("FS_GCS_ENABLE", 0, _INT8),  # *
    ("FS_GCS_TIMEOUT", 5.0, _REAL32),  # *
    ("FS_OPTIONS", 16, _INT32),  # *
    ("FS_THR_ENABLE", 1, _INT8),
    ("GUID_OPTIONS", 0, _INT32),  # *
    ("GUID_TIMEOUT", 3.0, _REAL32),  # *
    ("INS_GYR_ID", 2752772, _INT32),
    ("LAND_ALT_LOW", 1000.0, _REAL32),  # * cm
    ("LAND_SPEED", 50.0, _REAL32),  # * cm/s
    ("LOIT_SPEED", 1250.0, _REAL32),
    ("MAV_GCS_SYSID", 255, _INT16),  # *
    ("MAV_OPTIONS", 0, _INT16),
    ("MAV_SYSID", 1, _INT16),
    ("MAV1_EXTRA1", 0, _INT16),
    ("MAV1_POSITION", 0, _INT16),
    ("MOT_BAT_VOLT_MAX", 12.8, _REAL32),
    ("MOT_BAT_VOLT_MIN", 9.6, _REAL32),
    ("MOT_HOVER_LEARN", 2, _INT8),  # *
    ("MOT_SPIN_MIN", 0.15, _REAL32),
    ("MOT_THST_EXPO", 0.65, _REAL32),
    ("MOT_THST_HOVER", 0.39, _REAL32),  # *
    ("PSC_POSXY_P", 1.0, _REAL32),  # *
    ("PSC_POSZ_P", 1.0, _REAL32),  # *
    ("PSC_VELXY_I", 1.0, _REAL32),  # *
    ("PSC_VELXY_P", 2.0, _REAL32),  # *
    ("PSC_VELZ_P", 5.0, _REAL32),  # *
    ("RTL_ALT", 1500.0, _REAL32),  # * cm
    ("RTL_CONE_SLOPE", 3.0, _REAL32),  # *
    ("RTL_LOIT_TIME", 5000, _INT32),  # * ms
    ("SCHED_LOOP_RATE", 400, _INT16),  # *
    ("SERIAL0_PROTOCOL", 2, _INT8),
    ("SERIAL1_PROTOCOL", 2, _INT8),
    ("SIM_RATE_HZ", 1200, _INT16),
    ("SIM_SPEEDUP", 1.0, _REAL32),
    ("STAT_FLTTIME", 0, _INT32),
    ("STAT_RUNTIME", 0, _INT32),
    ("WPNAV_ACCEL_Z", 100.0, _REAL32),  # * cm/s^2
    ("WPNAV_SPEED", 1000.0, _REAL32),  # * cm/s
    ("WPNAV_SPEED_DN", 150.0, _REAL32),  # * cm/s
    ("WPNAV_SPEED_UP", 250.0, _REAL32),  # * cm/s
)

ARDUPILOT_PARAMETERS = tuple(Parameter(name, value) for name, value, _ in _PARAMETERS)
ARDUPILOT_TYPES = {name: int(kind) for name, _, kind in _PARAMETERS}
"""MAV_PARAM_TYPE by name."""
