"""Batch kinematics: the open-loop steps of a maneuver, simulated with attitude and rate loop only.

There is no position, no estimator and no link. The planner's control law and the attitude functions
are those of a flight, compiled. The section `vehicle` gives the dead time, slew limit, lag and
damping of the simulated rate loop; in a flight, the program only assumes these values. The vehicle
begins level and without rotation, at the heading `mock.home.heading_deg`.
"""

import hashlib
from functools import lru_cache
from itertools import pairwise
from math import inf, isfinite, radians
from statistics import fmean

import numpy as np

from companion.attitude import LawPlanner, attitude
from companion.attitude.planner import LAW_NAMES
from companion.attitude.rate_response import AxisResponse
from companion.attitude.representation import limited_target, wrap_angle
from companion.attitude.types import Coefficients, Target
from companion.batch.loops import Array
from companion.batch.rate_loop import STEP_HZ, StepFlight, fly_steps
from companion.batch.step_figures import StepFigures, step_figures
from companion.campaign.case import Case
from companion.campaign.swept import Value
from companion.config import Config
from companion.config.flight import ACCELERATION_STEPS
from companion.control.inner_loop import planner
from companion.files.yaml_file import ConfigError
from companion.guidance import Corners, Steps
from companion.guidance.reference import Pose
from companion.recording.measurements.verdict import MAX_LINE_DISTANCE


def check_case(case: Case) -> None:
    """Check that a case can be flown in a batch.

    Raises:
        ConfigError: the planner keeps state, no maneuver has open-loop steps, 1000 Hz is no
            multiple of the sample rate, or the case has a fault.
    """
    if reason := _unflyable_reason(case):
        raise ConfigError(f"{case.description()}: {reason}")


def _unflyable_reason(case: Case) -> str | None:
    """Why a case cannot be flown in a batch; None: it can."""
    config = case.config
    if config.planner_name not in LAW_NAMES:
        return (
            f"kind: batch flies planners without memory ({', '.join(LAW_NAMES)}), not "
            f"{config.planner_name}; set planner.name, or kind: flights"
        )
    if not set(ACCELERATION_STEPS) & set(config.flight.maneuvers):
        return "kind: batch flies open-loop steps; set flight.maneuvers to [corners] or [steps]"
    if STEP_HZ % config.link.attitude_rate_hz:
        return (
            f"kind: batch needs a link.attitude_rate_hz that divides {STEP_HZ}, not "
            f"{config.link.attitude_rate_hz:g}"
        )
    if case.fault is not None:
        return "kind: batch has no faults; set kind: flights"
    return None


def run_case(case: Case) -> dict[str, Value]:
    """Simulate one case; return its row of results.

    `ok` is true if in every step the acceleration coefficients stayed close to the straight line
    from start to target, within the bound that flights must keep.

    Raises:
        ConfigError: the case cannot be flown in a batch; see `check_case`.
        MissingExtraError: numba is not installed.
    """
    check_case(case)
    config = case.config
    law_planner = planner(config)
    assert isinstance(law_planner, LawPlanner)
    heading = wrap_angle(radians(case.mock["home"]["heading_deg"]))
    targets = _targets(config, law_planner.constants.max_target_norm, heading)
    start = attitude(Coefficients(0.0, 0.0), heading)
    rate_hz = config.link.attitude_rate_hz
    flight = fly_steps(law_planner, _rate_loop(config), start, targets, round(STEP_HZ / rate_hz))
    figures = step_figures(flight, config.planner.gain_per_s, 1.0 / rate_hz)
    longest_target = float(np.hypot(*targets[:, :2].T).max())
    return {
        "case": case.index,
        "seed": case.seed,
        **case.factors,
        **_outcomes(flight, figures, longest_target),
    }


def _outcomes(flight: StepFlight, figures: StepFigures, longest_target: float) -> dict[str, Value]:
    """The outcomes of a case; `longest_target`: largest √(north² + east²) of a target."""
    time_constants = [constant for constant in figures[-2:] if isfinite(constant)]  # north and east
    values = {
        "cross_axis_max": figures.cross_axis_max,
        "model_deviation_max": figures.model_deviation_max,
        "time_constant_s": fmean(time_constants) if time_constants else inf,
        "rate_rms_rad_s": figures.rate_rms,
        "rate_max_rad_s": figures.rate_max,
    }
    is_finite = bool(np.isfinite(flight.commanded_rates).all() and np.isfinite(flight.q).all())
    is_straight = is_finite and figures.cross_axis_max <= MAX_LINE_DISTANCE * longest_target
    result = "ok" if is_straight else "not straight" if is_finite else "not finite"
    return {
        "ok": is_straight,
        "result": result,
        **{name: value if isfinite(value) else None for name, value in values.items()},
        "digest": _digest(flight),
    }


def _digest(flight: StepFlight) -> str:
    """SHA-256 of all commanded body rates and of the final attitude."""
    sha256 = hashlib.sha256(np.ascontiguousarray(flight.commanded_rates).data)
    sha256.update(np.array(flight.q).data)
    return sha256.hexdigest()


def _rate_loop(config: Config) -> list[AxisResponse]:
    """Response of roll, pitch and yaw rate to the commanded rates.

    Of the section `vehicle`, a null lag or dead time counts as 0 s, a null acceleration limit as no
    slew limit, and a null damping as a first-order lag.
    """
    return [
        AxisResponse(
            axis.lag or 0.0,
            axis.dead_time or 0.0,
            inf if axis.acceleration_limit is None else axis.acceleration_limit,
            inf if axis.damping is None else axis.damping,
        )
        for axis in config.vehicle.axes.values()
    ]


def _targets(config: Config, max_target_norm: float, heading: float) -> Array:
    """Targets of the open-loop steps, limited as the planner limits them.

    Returns:
        (samples, 4): acceleration coefficients north and east, heading (rad), heading rate (rad/s).
    """
    name = next(maneuver for maneuver in config.flight.maneuvers if maneuver in ACCELERATION_STEPS)
    amplitude: tuple[float, float]
    if name == "corners":
        corners = config.corners
        amplitude = corners.north_coefficient, corners.east_coefficient
        unit_maneuver: Corners | Steps = Corners(1.0, 1.0, corners.duration_s, corners.settle_s)
    else:
        steps = config.steps
        amplitude = steps.coefficient, steps.coefficient
        unit_maneuver = Steps(1.0, steps.duration_s, steps.settle_s)
    constant_spans = _constant_spans(unit_maneuver, config.link.attitude_rate_hz)
    targets = np.zeros((constant_spans[-1][1], 4))
    targets[:, 2] = heading
    for begin, end, (north, east) in constant_spans:
        unlimited_target = Target(north * amplitude[0], east * amplitude[1], heading)
        targets[begin:end] = limited_target(unlimited_target, max_target_norm)
    return targets


@lru_cache(maxsize=64)
def _constant_spans(
    maneuver: Corners | Steps, rate_hz: float
) -> tuple[tuple[int, int, Coefficients], ...]:
    """The open-loop steps of a maneuver and the level parts between them.

    The maneuver has amplitude 1, so that the cached parts serve cases of all amplitudes.

    Returns:
        for each part: its first sample, the sample after its last, its acceleration coefficients.
    """
    pose = Pose((0.0, 0.0, 0.0), 0.0)
    times = np.arange(round(maneuver.duration * rate_hz)) / rate_hz
    commanded_coefficients = [maneuver.at(float(time), pose).coefficients for time in times]
    step_samples = [
        k for k, coefficients in enumerate(commanded_coefficients) if coefficients is not None
    ]
    level = Coefficients(0.0, 0.0)
    targets = [
        coefficients or level
        for coefficients in commanded_coefficients[step_samples[0] : step_samples[-1] + 1]
    ]
    span_ends = [k for k in range(1, len(targets)) if targets[k] != targets[k - 1]]
    spans = pairwise((0, *span_ends, len(targets)))
    return tuple((begin, end, targets[begin]) for begin, end in spans)
