"""Compares the figures of `--json` with their limits, and tells whether a flight was good."""

from collections.abc import Iterator, Mapping
from math import radians, sin
from typing import Any, NamedTuple

from companion.attitude.planner import MODEL_FOLLOWING

Figures = Mapping[str, Any]
"""Figures of a flight: the result of `Summary.as_dict`."""

MAX_HORIZONTAL_RMS, MAX_HORIZONTAL_RMS_PER_SPEED = 0.15, 0.02
"""Largest RMS of the horizontal error of a maneuver: the first in m, plus the second in m for each
m/s of the reference's speed."""
MAX_HEIGHT_RMS = 0.15
"""Largest RMS error of the height, m."""
MIN_CONSTANT_SHARE = 0.7
"""A height error counts as constant if its |mean| is more than this share of its RMS."""
MAX_SWING_RMS = 3.0
"""Largest RMS of a swing of roll and pitch, °."""
MIN_SWING_REGULARITY = 0.7
"""Smallest autocorrelation of a swing; below it, the motion comes from wind and noise."""
MAX_LINE_DISTANCE = 0.03
"""Largest distance from the straight line of a step, as a share of the step."""
MAX_MODEL_DEVIATION = 0.20
"""Largest distance from the nearest second-order model, as a share of the step."""
MAX_UNANSWERED_SHARE = 0.01
"""Largest share of attitude samples for which no setpoint was sent."""
MAX_LOST_SHARE = 0.02
"""Largest share of the vehicle's frames that may be lost."""
MIN_BATTERY_MARGIN = 0.10
"""Smallest margin of the charge at the end above `limits.min_battery_percent`, 0..1."""

LATENCY = "latency"
"""Value of `Check.what` in the check of the latency from sample to setpoint."""
OFF_COURSE = "too far from its path"
"""Last words of `Check.fault` for a maneuver whose horizontal error was too large."""
LOST_ROWS = "rows of the flight's figures were lost"
"""Words that identify the advice about lost rows, which the disk causes, not the configuration."""


class Check(NamedTuple):
    """One figure and its limit."""

    what: str
    """Subject of the check, such as a maneuver or "latency"."""
    found: str
    """Figure that was found, and its limit, in words."""
    good: bool
    """Whether the figure is within its limit."""
    remedy: str
    """What to do if the figure is beyond its limit."""
    fault: str
    """What is wrong if the figure is beyond its limit; without numbers, so that a campaign can
    count the flights with this fault."""


def checks(figures: Figures) -> list[Check]:
    """All checks whose figures were measured in the flight; empty if nothing was measured."""
    subjects = _maneuvers, _steps, _answers, _latency, _battery
    return [check for checks_of in subjects for check in checks_of(figures)]


def is_good(figures: Figures) -> bool:
    """Whether a flight reached its end, with all figures within their limits and without advice.

    Advice says which configuration values do not fit the vehicle, and whether rows were lost.
    """
    good = all(check.good for check in checks(figures))
    return figures["result"] == "ok" and good and not figures["advice"]


def _maneuvers(figures: Figures) -> Iterator[Check]:
    for maneuver in figures["maneuvers"]:
        horizontal_rms, height_rms = maneuver["level_rms_m"], maneuver["height_rms_m"]
        if horizontal_rms is not None:
            speed = maneuver["reference_speed_max_m_s"] or 0.0
            limit = MAX_HORIZONTAL_RMS + MAX_HORIZONTAL_RMS_PER_SPEED * speed
            yield Check(
                maneuver["name"],
                f"{horizontal_rms:.2f} m RMS from its path (limit {limit:.2f} m), "
                f"at most {maneuver['level_max_m']:.2f} m",
                horizontal_rms <= limit,
                _horizontal_remedy(speed, drag_was_learned=bool(figures.get("drag_learned"))),
                f"{maneuver['name']}: {OFF_COURSE}",
            )
        if height_rms is not None:
            yield Check(
                maneuver["name"],
                f"{height_rms:.2f} m RMS in height (limit {MAX_HEIGHT_RMS:.2f} m)",
                height_rms <= MAX_HEIGHT_RMS,
                _height_remedy(height_rms, maneuver.get("height_mean_m")),
                f"{maneuver['name']}: too far from its height",
            )
        yield from _swing(maneuver)


def _horizontal_remedy(speed: float, *, drag_was_learned: bool) -> str:
    """The remedy for a too large horizontal error in a maneuver.

    `speed`: largest speed of its reference, m/s. `drag_was_learned`: whether the flight learned a
    drag that the next flight uses.
    """
    if drag_was_learned:
        return "fly again: the next flight begins with the drag that this flight learned"
    advice = "fly it slower" if speed > 0.0 else "fly in less wind"
    return f"{advice}, set guidance.drag_per_s to the vehicle's drag, or run `companion identify`"


def _height_remedy(rms: float, mean: float | None) -> str:
    if mean is not None and abs(mean) > MIN_CONSTANT_SHARE * rms:
        return "set thrust.hover_thrust to the thrust at which the vehicle hovers"
    return (
        "the error changes in flight: climb and descend more slowly, set guidance.drag_per_s to "
        "the vehicle's drag, or raise guidance.height_gain_per_s"
    )


def _swing(maneuver: Mapping[str, Any]) -> Iterator[Check]:
    rms = maneuver.get("swing_rms_deg")
    if rms is None:
        return
    is_regular = (maneuver["swing_regularity"] or 0.0) >= MIN_SWING_REGULARITY
    yield Check(
        maneuver["name"],
        f"swings by {rms:.1f}° RMS every {maneuver['swing_period_s']:.2g} s "
        f"(limit {MAX_SWING_RMS:g}°)"
        if is_regular
        else f"no periodic swing (roll and pitch {rms:.1f}° RMS)",
        rms <= MAX_SWING_RMS or not is_regular,
        "lower planner.gain_per_s or the weights guidance.position_weight_per_s4 and "
        "velocity_weight_per_s2; `companion check-config` names the largest sensible gain",
        f"{maneuver['name']}: it swings",
    )


def _steps(figures: Figures) -> Iterator[Check]:
    response = figures["response"]
    step_size, cross_axis_max = response["step_size"], response["cross_axis_max"]
    if not step_size or cross_axis_max is None:
        return
    limit, deviation_limit = MAX_LINE_DISTANCE * step_size, MAX_MODEL_DEVIATION * step_size
    tilt_checks = cut_step_checks(figures)
    yield from tilt_checks
    yield Check(
        "straightness of the steps",
        f"{cross_axis_max:.4f} from their lines (limit {limit:.4f})",
        cross_axis_max <= limit,
        _straightness_remedy(figures["planner"], was_cut=bool(tilt_checks)),
        "steps not straight",
    )
    deviation = response["second_order"]["deviation_max"]
    if deviation is None:
        return
    yield Check(
        "linearity of the steps",
        f"{deviation:.3f} from the nearest second-order model (limit {deviation_limit:.3f})",
        deviation <= deviation_limit,
        "first keep the steps within limits.max_tilt_deg, because a cut step distorts the response"
        if tilt_checks
        else "a rate limit distorts large steps: lower steps.coefficient or raise "
        "limits.max_tilt_rate_deg_s",
        "steps not linear",
    )


def cut_step_checks(figures: Figures) -> list[Check]:
    """A failed check if the tilt limit cut a step by more than `MAX_LINE_DISTANCE`; else empty."""
    response, limit = figures["response"], figures.get("max_tilt_deg")
    target_tilt = response.get("asked_tilt_deg")
    if target_tilt is None or limit is None:  # nothing was measured, or the summary is older
        return []
    # A coefficient is the sine of a tilt.
    if sin(radians(target_tilt)) - sin(radians(limit)) <= MAX_LINE_DISTANCE * response["step_size"]:
        return []
    return [
        Check(
            "tilt of the steps",
            f"the tilt limit cut a step, which asked for {target_tilt:.1f}° (limits.max_tilt_deg: "
            f"{limit:g})",
            good=False,
            remedy="lower steps.coefficient or the corners' coefficients, fly in less wind, or "
            "raise limits.max_tilt_deg",
            fault="the tilt limit cut a step",
        )
    ]


def _straightness_remedy(planner: str, *, was_cut: bool) -> str:
    if was_cut:
        return "first keep the steps within limits.max_tilt_deg, because a cut step leaves its line"
    if planner == MODEL_FOLLOWING:
        return (
            "measure vehicle.lag_ms and vehicle.dead_time_ms anew with `companion identify`, lower "
            "planner.gain_per_s, or fly in less wind"
        )
    return (
        f"run `companion identify` and fly planner.name: {MODEL_FOLLOWING} with the lag and dead "
        "time that it finds"
    )


def _answers(figures: Figures) -> Iterator[Check]:
    samples, unanswered = figures["samples"], sum(figures["unanswered"].values())
    if samples:
        yield Check(
            "attitude samples",
            f"{unanswered} of {samples} unanswered (limit {100.0 * MAX_UNANSWERED_SHARE:g} %)",
            unanswered <= MAX_UNANSWERED_SHARE * samples,
            "the line `unanswered samples` names the reasons",
            "too many samples unanswered",
        )
    frames, lost = figures["link"].get("frames", 0), figures["link"].get("lost", 0)
    if frames:
        yield Check(
            "link",
            f"{lost} of {frames + lost} frames lost (limit {100.0 * MAX_LOST_SHARE:g} %)",
            lost <= MAX_LOST_SHARE * (frames + lost),
            "raise the baud rate, lower the rates of other streams, or improve the radio link",
            "too many frames lost",
        )


def _latency(figures: Figures) -> Iterator[Check]:
    p99_us = figures["latency_us"]["p99"]
    if figures["lockstep"] or p99_us is None:
        return  # vehicle time has no latency
    deadline = figures["deadline_ms"]
    yield Check(
        LATENCY,
        f"{1e-3 * p99_us:.2f} ms in 99 % of the answers (deadline {deadline:g} ms)",
        1e-3 * p99_us <= deadline,
        "end other programs on this computer, or set realtime.scheduler: fifo",
        "answers too late",
    )


def _battery(figures: Figures) -> Iterator[Check]:
    charge_at_end, min_charge = figures["battery"]["end"], figures["battery"]["min"]
    if charge_at_end is None:
        return
    limit = min_charge + MIN_BATTERY_MARGIN
    yield Check(
        "battery",
        f"{100.0 * charge_at_end:.0f} % at the end (at least {100.0 * limit:.0f} %)",
        charge_at_end >= limit,
        "charge it before the next flight: below limits.min_battery_percent the vehicle lands",
        "battery nearly empty",
    )
