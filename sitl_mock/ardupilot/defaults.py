"""ArduCopter's parameters, and the defaults of its simulated vehicle (measured).

The parameters have the types and defaults of ArduPilot's simulated quadrotor. Recorded names
are those of ArduPilot 4.7. Parameters marked * have an effect in the mock. All others exist because
clients read them or users look for them.
"""

from typing import Any

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.ardupilot.boot import RECORDED_READY_S
from sitl_mock.ardupilot.thrust import specific_thrust
from sitl_mock.autopilot.parameters import Parameter
from sitl_mock.config.airframe import AirframeConfig
from sitl_mock.config.rate_loop import AxisGains, RateLoopConfig

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
    ("FLTMODE_GCSBLOCK", 0, _INT32),
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
    ("MAV_SYSID", 1, _INT16),  # *
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
ARDUPILOT_TYPES = {name: int(param_type) for name, _, param_type in _PARAMETERS}
"""MAV_PARAM_TYPE by name."""
BURST_MS = 5.6
"""Period of the bursts of the simulator's telemetry, ms (measured: 5.4 to 5.8)."""
ROTOR_LAG_MS = 22.5
"""Time constant of the specific thrust, ms: one lag in place of the measured dead time of 15 ms and
lag of 5 ms."""

RATE_LAG_MS = 11.0
"""Delay of the gyro's low pass, ms (measured)."""
STAMP_SLIPS_HZ = 1.6
"""Mean number of 1 ms jumps of the time stamp of LOCAL_POSITION_NED per second (measured in circles
and figure-eights: 0.3 to 2.7); see `StampSlips`."""

AIRFRAME: dict[str, Any] = {
    "thrust_slope_m_s2": specific_thrust(1.0),
    "thrust_offset_m_s2": 0.0,
    "rotor_lag_ms": ROTOR_LAG_MS,
    # Its simulator's drag acts along the body's axes. Fitted to the truth of circles and
    # figure-eights at 5 and 8 m/s, with a residual of 0.01 to 0.03 m/s^2.
    "drag_n_s_per_m": 0.0,
    "axis_drag_n_s2_per_m2": (0.0345, 0.0345, 0.06),
    "momentum_drag_n_s_per_m": (0.25, 0.25, 0.2),
}

BATTERY: dict[str, Any] = {
    "cells": 3,
    "capacity_ah": 3.3,
    # Recorded: the voltage does not sag, and a hover draws 28 A.
    "full_cell_v": 4.2,
    "empty_cell_v": 4.2,
    "resistance_ohm": 0.0,
    "idle_current_a": 0.0,
    "hover_current_a": 28.0,
    "thrust_exponent": 0.0,
}


def _with_rotor_lag(gains: AxisGains, inertia: float) -> AxisGains:
    """Return gains that give, with ROTOR_LAG_MS, the poles and the steady state of ``gains``.

    ``gains`` were fitted with the rotor lag of the default airframe. An axis without a torque
    filter has the transfer function (P + F) / (J T s^2 + (J + b T + D) s + P + b), with gains P and
    D, feed-forward F, inertia J, aerodynamic damping b and rotor lag T. For an axis with a torque
    filter, the filter's time constant increases by as much as the rotor lag decreases, because two
    lags in series respond almost as one lag with the sum of their time constants.
    """
    default_airframe = AirframeConfig()
    lag_reduction_ms = default_airframe.rotor_lag_ms - ROTOR_LAG_MS
    if gains.torque_filter_ms > 0.0:
        return gains.model_copy(
            update={"torque_filter_ms": gains.torque_filter_ms + lag_reduction_ms}
        )
    drag = default_airframe.rotational_drag_n_m_s
    lag_ratio = ROTOR_LAG_MS / default_airframe.rotor_lag_ms
    stiffness = gains.proportional_n_m_s + drag
    steady_gain = (gains.proportional_n_m_s + gains.feed_forward_n_m_s) / stiffness
    proportional = lag_ratio * stiffness - drag
    return gains.model_copy(
        update={
            "proportional_n_m_s": proportional,
            "feed_forward_n_m_s": steady_gain * lag_ratio * stiffness - proportional,
            "damping_n_m_s2": lag_ratio * (inertia + gains.damping_n_m_s2) - inertia,
        }
    )


def _rate_loop() -> RateLoopConfig:
    measured_loop = RateLoopConfig.ardupilot()
    x, y, z = AirframeConfig().inertia_kg_m2
    return RateLoopConfig(
        roll=_with_rotor_lag(measured_loop.roll, x),
        pitch=_with_rotor_lag(measured_loop.pitch, y),
        yaw=_with_rotor_lag(measured_loop.yaw, z),
    )


RATE_LOOP = _rate_loop()


def with_ardupilot_defaults(section: dict[str, Any]) -> dict[str, Any]:
    """Return the ``mock:`` section, completed by the defaults of ArduCopter's simulator."""
    top_level = {"prearm_delay_s": RECORDED_READY_S, "rate_loop": RATE_LOOP, "burst_ms": BURST_MS}
    completed_section = {**top_level, **section}
    if completed_section["rate_loop"] == "ardupilot":
        completed_section["rate_loop"] = RATE_LOOP
    sensors = {"rate_lag_ms": RATE_LAG_MS, "stamp_slips_hz": STAMP_SLIPS_HZ}
    for key, defaults in (("airframe", AIRFRAME), ("battery", BATTERY), ("sensors", sensors)):
        configured_section = section.get(key, {})
        completed_section[key] = (
            {**defaults, **configured_section}
            if isinstance(configured_section, dict)
            else configured_section
        )
    return completed_section
