"""A vehicle whose drag, lag, dead time and noise differ from the shipped ones by one factor.

The set-up of the measurement in docs/campaigns.md, fixed before its first flight. By hand:

    python -m tests.campaign.unlike px4 1.4 > px4-14.yaml
    companion campaign tune px4-14.yaml --workers 1
"""

import json
import sys
from typing import Any

from companion.config.files import load, shipped
from companion.testing.settings import mock_with_defaults

_LIMITS = {
    "limits.max_tilt_deg": 54,
    "limits.max_tilt_rate_deg_s": 135,
    "limits.max_thrust": 0.95,
    "limits.fence_radius_m": 50,
    "limits.fence_ceiling_m": 50,
    "limits.fence_floor_m": 1,
}
"""The figure-eight needs them."""
_QUICK = {
    "px4": {"MPC_TKO_RAMP_T": 0.3, "MPC_TKO_SPEED": 3.0, "MPC_LAND_SPEED": 3.0},
    "ardupilot": {"LAND_SPEED": 150.0},
}
"""Parameters that shorten take-off and landing."""
_DRAG = "drag_n_s_per_m", "quadratic_drag_n_s2_per_m2"
_AXIS_DRAG = "axis_drag_n_s2_per_m2", "momentum_drag_n_s_per_m"
_NOISE = (
    "attitude_noise_deg",
    "rate_noise_rad_s",
    "position_noise_m",
    "velocity_noise_m_s",
    "acceleration_noise_m_s2",
)
_FILTER_NOISE = (
    "position_noise_m",
    "velocity_noise_m_s",
    "tilt_noise_deg",
    "yaw_error_deg",
    "height_noise_m",
    "sink_noise_m_s",
)


def vehicle(autopilot: str, factor: float) -> dict[str, Any]:
    """Keys of the mock vehicle: drag, times of the rate loop, and noise, all times `factor`."""
    whole: Any = mock_with_defaults({"autopilot": autopilot})
    air, sensors = whole["airframe"], whole["sensors"]
    keys = {f"airframe.{key}": factor * air[key] for key in (*_DRAG, "rotor_lag_ms")}
    keys |= {f"airframe.{key}": [factor * share for share in air[key]] for key in _AXIS_DRAG}
    keys |= {f"sensors.{key}": factor * sensors[key] for key in (*_NOISE, "attitude_delay_ms")}
    keys |= {f"sensors.ekf.{key}": factor * sensors["ekf"][key] for key in _FILTER_NOISE}
    for name, axis in whole["rate_loop"].items():
        keys |= {f"rate_loop.{name}.{key}": value for key, value in _slower(axis, factor).items()}
    return {f"mock.{key}": value for key, value in keys.items()}


def _slower(axis: dict[str, Any], factor: float) -> dict[str, float]:
    """Gains and delays with which an axis answers in the same shape, `factor` times as slowly."""
    keys = {
        "proportional_n_m_s": axis["proportional_n_m_s"] / factor,
        "integral_n_m": axis["integral_n_m"] / factor**2,
        "feed_forward_n_m_s": axis["feed_forward_n_m_s"] / factor,
        "torque_filter_ms": axis["torque_filter_ms"] * factor,
        "setpoint_delay_ms": axis["setpoint_delay_ms"] * factor,
    }
    shaping = axis["shaping"]
    if shaping is not None:
        keys["shaping.delay_ms"] = shaping["delay_ms"] * factor
        keys["shaping.attitude_gain_1_s"] = shaping["attitude_gain_1_s"] / factor
    return keys


def campaign(autopilot: str, factor: float, **tune: Any) -> dict[str, Any]:
    """The campaign's file: circle and figure-eight at 5 m/s in still air, from the shipped file."""
    path = shipped(f"mock-{autopilot}.yaml")
    base = load(path)
    times = {"lag_ms", "dead_time_ms", "pitch_lag_ms", "pitch_dead_time_ms"}
    known = base.vehicle.model_dump(include=times, exclude_none=True)
    search: dict[str, Any] = {
        "planner.gain_per_s": {"uniform": [2.0, 10.0]},
        "guidance.drag_per_s": _about(base.guidance.drag_per_s),
        "guidance.position_weight_per_s4": {"loguniform": [5.0, 400.0]},
        "guidance.velocity_weight_per_s2": {"loguniform": [1.0, 60.0]},
        "guidance.disturbance_bandwidth_rad_s": {"loguniform": [0.5, 20.0]},
        "guidance.position_lateness_ms": {"uniform": [0.0, 40.0]},
        **{f"vehicle.{key}": _about(value) for key, value in known.items()},
    }
    return {
        "name": f"unlike-{autopilot}",
        "config": str(path),
        "samples": 2,
        "set": {
            **_LIMITS,
            "flight.takeoff_height_m": 5.0,
            "mock.prearm_delay_s": 0.2,
            **{f"mock.parameters.{name}": value for name, value in _QUICK[autopilot].items()},
            **vehicle(autopilot, factor),
        },
        "sweep": {
            "flight.trajectory": [
                str(shipped(f"trajectories/{name}.yaml")) for name in ("circle5", "figure8")
            ]
        },
        "tune": {"trials": 24, "check_samples": 6, "search": search, **tune},
    }


def _about(value: float | None) -> dict[str, list[float]]:
    """From half to twice the shipped value."""
    assert value is not None
    return {"uniform": [0.5 * value, 2.0 * value]}


if __name__ == "__main__":
    print(json.dumps(campaign(sys.argv[1], float(sys.argv[2])), indent=1))
