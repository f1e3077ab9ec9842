"""What a mock vehicle with ArduCopter is made of where its settings say nothing (measured)."""

from typing import Any

from sitl_mock.ardupilot.boot import RECORDED_READY_S
from sitl_mock.ardupilot.thrust import specific_thrust
from sitl_mock.config.airframe import AirframeConfig, AxisGains, RateLoopConfig

BURST_MS = 5.6
"""Time from burst to burst of the simulator's telemetry (measured: 5.4 to 5.8)."""
ROTOR_LAG_MS = 22.5
"""Specific thrust answers with this time constant (measured: 5 ms behind a dead time of 15 ms)."""

AIRFRAME: dict[str, Any] = {
    "thrust_slope_m_s2": specific_thrust(1.0),
    "thrust_offset_m_s2": 0.0,
    "rotor_lag_ms": ROTOR_LAG_MS,
    # Measured: 0.31 per second at 2 m/s, 0.41 at 5 m/s.
    "drag_n_s_per_m": 0.25,
    "quadratic_drag_n_s2_per_m2": 0.033,
}

BATTERY: dict[str, Any] = {
    "cells": 3,
    "capacity_ah": 3.3,
    # Recorded: the voltage never sags, and a hover draws 28 A.
    "full_cell_v": 4.2,
    "empty_cell_v": 4.2,
    "resistance_ohm": 0.0,
    "idle_current_a": 0.0,
    "hover_current_a": 28.0,
    "thrust_exponent": 0.0,
}


def _behind_rotors(gains: AxisGains, inertia: float) -> AxisGains:
    """Return gains with the same poles and the same steady share behind ROTOR_LAG_MS.

    With inertia J, damping b and rotor lag T an axis without a torque filter answers as
    (P + F) / (J T s^2 + (J + b T + D) s + P + b). Where there is a filter, it makes up for the
    quicker rotors: two lags in a row answer by their sum, nearly.
    """
    measured_on = AirframeConfig()
    quicker = measured_on.rotor_lag_ms - ROTOR_LAG_MS
    if gains.torque_filter_ms > 0.0:
        return gains.model_copy(update={"torque_filter_ms": gains.torque_filter_ms + quicker})
    drag = measured_on.rotational_drag_n_m_s
    ratio = ROTOR_LAG_MS / measured_on.rotor_lag_ms
    stiffness = gains.proportional_n_m_s + drag
    steady = (gains.proportional_n_m_s + gains.feed_forward_n_m_s) / stiffness
    proportional = ratio * stiffness - drag
    return gains.model_copy(
        update={
            "proportional_n_m_s": proportional,
            "feed_forward_n_m_s": steady * ratio * stiffness - proportional,
            "damping_n_m_s2": ratio * (inertia + gains.damping_n_m_s2) - inertia,
        }
    )


def _rate_loop() -> RateLoopConfig:
    measured = RateLoopConfig.ardupilot()
    x, y, z = AirframeConfig().inertia_kg_m2
    return RateLoopConfig(
        roll=_behind_rotors(measured.roll, x),
        pitch=_behind_rotors(measured.pitch, y),
        yaw=_behind_rotors(measured.yaw, z),
    )


RATE_LOOP = _rate_loop()


def with_ardupilot_defaults(section: dict[str, Any]) -> dict[str, Any]:
    """Return the settings given, what they leave open filled in."""
    own = {"prearm_delay_s": RECORDED_READY_S, "rate_loop": RATE_LOOP, "burst_ms": BURST_MS}
    filled = {**own, **section}
    if filled["rate_loop"] == "ardupilot":
        filled["rate_loop"] = RATE_LOOP
    for key, defaults in (("airframe", AIRFRAME), ("battery", BATTERY)):
        given = section.get(key, {})
        filled[key] = {**defaults, **given} if isinstance(given, dict) else given
    return filled
