"""The outcomes of a flight: one row of the results."""

import hashlib
import struct
from collections.abc import Mapping, Sequence
from math import isfinite, nan
from statistics import fmean
from typing import Any

import numpy as np

from companion.campaign.swept import Value
from companion.config import Config
from companion.recording.measurements.maneuver_figures import Floats, settled_maneuver_rows
from companion.recording.measurements.summary import Summary, tracking_errors
from companion.testing import ReceivedSetpoint, Truth
from companion.testing.truth import true_positions

OUTCOME_LABELS = {
    "position_rms_m": "true position error, RMS",
    "position_max_m": "true position error, largest",
    "height_rms_m": "true height error, RMS",
    "estimated_rms_m": "estimated position error, RMS",
    "level_rms_m": "true horizontal error, RMS",
    "estimated_level_rms_m": "estimated horizontal error, RMS",
    "estimate_level_rms_m": "horizontal error of the estimate itself, RMS",
    "cross_axis_max": "distance from the line of a step",
    "model_deviation_max": "distance from the first-order model",
    "time_constant_s": "time constant",
    "rate_rms_rad_s": "commanded roll-pitch rate, RMS",
    "rate_max_rad_s": "commanded roll-pitch rate, largest",
    "thrust_rms": "thrust, deviation from its mean, RMS",
    "saturated_share": "share of setpoints at a limit",
    "max_tilt_rad": "largest true tilt",
    "flight_s": "flight time",
}
"""Label of each outcome of a flight that is a number; an outcome that was not measured is null."""
_SATURATION_SHARE = 0.99
"""A setpoint counts as saturated if its rate or thrust is at least this share of the upper limit,
or its thrust is at most the lower limit divided by this share."""


def tracking(summary: Summary, truth: Floats) -> dict[str, float]:
    """Tracking errors of the true and of the estimated position, m, and the largest true tilt, rad.

    The errors cover the closed-loop maneuvers, each from the end of its settling time. The tilt is
    the largest from the end of the first settling time to the end of the last closed-loop maneuver.

    Args:
        summary: summary of the flight.
        truth: (N, 5), see `TruthRecorder.rows`.

    Returns:
        value by name of the outcome; empty without a closed-loop maneuver or without `truth`.
    """
    tracking_rows = summary.trace.tracking.rows()
    settled_parts_rows = settled_maneuver_rows(tracking_rows, summary.trace.maneuvers)
    figures: dict[str, float] = {}
    if len(truth) and settled_parts_rows:
        settled_rows = np.concatenate(settled_parts_rows)
        figures["estimated_rms_m"] = tracking_errors(settled_rows)["position_rms_m"]
        true_position = true_positions(truth, settled_rows[:, 0])
        true_rows = np.column_stack([settled_rows[:, :4], true_position])
        figures.update(tracking_errors(true_rows))
        figures.update(_horizontal_errors(settled_rows, true_rows))
        in_maneuvers = (truth[:, 0] >= settled_rows[0, 0]) & (truth[:, 0] <= settled_rows[-1, 0])
        figures["max_tilt_rad"] = float(truth[in_maneuvers, 4].max(initial=0.0))
    return figures


def _horizontal_errors(estimated_rows: Floats, true_rows: Floats) -> dict[str, float]:
    """RMS horizontal distances, m: truth to reference, estimate to reference, estimate to truth.

    `estimated_rows` are (N, 7) rows of `FlightTrace.tracking`; `true_rows` are the same rows with
    the true position instead of the estimated one.
    """
    has_reference = np.isfinite(true_rows[:, 1])
    true_position, reference = true_rows[has_reference, 4:6], true_rows[has_reference, 1:3]
    position_estimate = estimated_rows[has_reference, 4:6]

    def rms(offsets: Floats) -> float:
        return float(np.sqrt(np.mean(np.sum(offsets**2, axis=1)))) if len(offsets) else nan

    return {
        "level_rms_m": rms(true_position - reference),
        "estimated_level_rms_m": rms(position_estimate - reference),
        "estimate_level_rms_m": rms(true_position - position_estimate),
    }


def response(summary: Summary) -> dict[str, float]:
    """Outcomes of the response to acceleration steps; empty if there were none."""
    step_response = summary.response()
    if step_response is None:
        return {}
    axis_time_constants = step_response.time_constant_north_s, step_response.time_constant_east_s
    known_time_constants = [value for value in axis_time_constants if isfinite(value)]
    return {
        "cross_axis_max": step_response.cross_axis_max,
        "model_deviation_max": step_response.model_deviation_max,
        "time_constant_s": fmean(known_time_constants) if known_time_constants else nan,
    }


def control_effort(
    setpoints: Sequence[ReceivedSetpoint], summary: Summary, config: Config
) -> dict[str, float]:
    """Outcomes of the rates (rad/s) and thrust (0..1) that the autopilot received in maneuvers.

    `thrust_rms` is the standard deviation of the thrust. Empty if there were no maneuvers.
    """
    maneuver_changes = summary.trace.maneuvers
    if not maneuver_changes:
        return {}
    begin_time = maneuver_changes[0].vehicle_time
    end_time = next(
        (change.vehicle_time for change in maneuver_changes if change.name is None), np.inf
    )
    setpoint_rows = np.array(
        [
            (*setpoint.rates, setpoint.thrust)
            for setpoint in setpoints
            if begin_time <= setpoint.time < end_time
        ]
    ).reshape(-1, 4)
    if not len(setpoint_rows):
        return {}
    rates = np.hypot(setpoint_rows[:, 0], setpoint_rows[:, 1])
    thrust, limits = setpoint_rows[:, 3], config.limits
    is_saturated = (
        (rates >= _SATURATION_SHARE * limits.max_tilt_rate)
        | (thrust >= _SATURATION_SHARE * limits.max_thrust)
        | (thrust * _SATURATION_SHARE <= limits.min_thrust)
    )
    return {
        "rate_rms_rad_s": float(np.sqrt(np.mean(rates**2))),
        "rate_max_rad_s": float(rates.max()),
        "thrust_rms": float(np.std(thrust)),
        "saturated_share": float(np.mean(is_saturated)),
    }


def digest(setpoints: Sequence[ReceivedSetpoint], state: Truth) -> str:
    """SHA-256 of all setpoints that the autopilot received, and of the final true state."""
    sha256 = hashlib.sha256()
    for setpoint in setpoints:
        times = setpoint.time, setpoint.sample_time_boot_ms
        sha256.update(struct.pack("<dq4d", *times, *setpoint.rates, setpoint.thrust))
    motion = (*state["position"], *state["velocity"], *state["q"], *state["rates"])
    sha256.update(struct.pack(f"<{len(motion)}d", *motion))
    return sha256.hexdigest()


def error_outcomes(result: str) -> dict[str, Value]:
    """The outcomes of a case that raised an error; `result` is the text of the error."""
    return {
        "ok": False,
        "result": result,
        "failed_checks": "",
        "phase": "",
        "crashed": False,
        "as_documented": None,
        **dict.fromkeys(OUTCOME_LABELS),
        "setpoints": 0,
        "digest": "",
    }


def failed_checks(figures: Mapping[str, Any]) -> str:
    """The reasons why a flight was not good, separated by semicolons; empty if it was good.

    Advice on the configuration does not count, because a campaign sweeps wrong values on purpose.
    """
    return "; ".join(
        dict.fromkeys(check["fault"] for check in figures["verdict"]["checks"] if not check["good"])
    )


def without_nan(values: Mapping[str, float]) -> dict[str, Value]:
    """A value for each of `OUTCOME_LABELS`; a missing or non-finite value is None."""
    outcomes = {name: values.get(name, nan) for name in OUTCOME_LABELS}
    return {name: value if isfinite(value) else None for name, value in outcomes.items()}
