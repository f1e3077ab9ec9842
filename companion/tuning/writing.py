"""Writes a proposal as YAML, with the reasons as comments, for a configuration to include."""

from collections.abc import Mapping
from math import degrees
from pathlib import Path
from typing import Any

from companion.control.hold_settings import disturbance_bandwidth, hold_weights, slewing_delay
from companion.control.inner_loop import LARGEST_GAIN_TIMES_DELAY, sensible_gain
from companion.files import bounded_yaml
from companion.tuning.expectation import Expectation
from companion.tuning.flights import TrialResult
from companion.tuning.loop import ModelMismatch
from companion.tuning.proposal import Proposal
from companion.tuning.search import largest_gain

Flights = Mapping[str, tuple[TrialResult, TrialResult]]
"""Results of the flights without and with the proposal, by name of the trial flight."""
_WORSE_FACTOR, _WORSE_DISTANCE = 1.25, 0.01
"""A flight is worse if its true error grows by more than this factor and by more than this
distance, m."""


def proposal_text(
    proposal: Proposal, vehicle: Path | Mapping[str, Any], flights: Flights, source: str
) -> str:
    """Text of the proposal's file: the expected behaviour, and the keys with their reasons.

    Args:
        proposal: the proposal.
        vehicle: path of the vehicle file to include, relative to the proposal's file; or a mapping
            with the section `vehicle`.
        flights: flights on the mock vehicle; empty if none was flown.
        source: text for the user: where the values of the vehicle come from.
    """
    lines = [f"# Proposed by `companion tune` for {source}.", "#"]
    lines += [f"# {line}".rstrip() for line in summary_lines(proposal, flights)]
    if isinstance(vehicle, Path):
        lines += ["", f"include: {bounded_yaml.dump_value(str(vehicle))}  # the identified vehicle"]
    else:
        lines += ["", *bounded_yaml.dump(dict(vehicle)).splitlines()]
    reasons = _reasons(proposal)
    for section, keys in proposal.changes.items():
        lines += ["", f"{section}:"]
        for key, value in keys.items():
            lines += [f"  # {reasons[key]}", f"  {key}: {value:g}"]
    return "\n".join(lines) + "\n"


def summary_lines(proposal: Proposal, flights: Flights) -> list[str]:
    """Text for the user: expected behaviour without and with the proposal, rates, and flights."""
    before, after, aims = proposal.before, proposal.after, proposal.aims
    max_tilt_rate_deg_s = degrees(proposal.tuned.limits.max_tilt_rate)
    warning = worse_flights_warning(flights)
    lines = [] if warning is None else [warning]
    lines += [
        "Expected by linear analysis, before -> after:",
        *_comparison_lines(before, after),
        f"disturbances: gusts of {proposal.disturbances.gust:g} m/s, noise: "
        f"{proposal.disturbances.source}",
        f"required margins: {aims.gain_db:g} dB and {aims.phase_deg:g}°; with errors of the "
        "vehicle model they are:",
    ]
    lines += [
        f"margin {_mismatch_text(mismatch)}: {margins.sentence()}"
        for mismatch, margins in proposal.margins_with_mismatches
    ]
    used_deg_s = 3.0 * degrees(after.errors.commanded_rate)
    lines.append(
        f"cost: these disturbances command up to {used_deg_s:.0f}°/s (3 standard deviations) of "
        f"the {max_tilt_rate_deg_s:.0f}°/s that limits.max_tilt_rate_deg_s allows; before: "
        f"{3.0 * degrees(before.errors.commanded_rate):.0f}°/s"
    )
    if flights:
        lines += [
            "",
            "Flown on the mock vehicle within limits.max_tilt_deg and limits.max_tilt_rate_deg_s, "
            "RMS in m, before -> after:",
        ]
        lines += [_flight_line(name, *pair) for name, pair in flights.items()]
    if flights and warning is None:
        percent = 100.0 * (_WORSE_FACTOR - 1.0)
        lines.append(
            f"No flight was worse by more than {percent:.0f} % and more than {_WORSE_DISTANCE:g} m."
        )
    return lines


def worse_flights_warning(flights: Flights) -> str | None:
    """A warning if a flight with the proposal failed or was worse than without; else None."""
    failed_as_before: list[str] = []
    worse_flights: list[str] = []
    for name, (before, after) in flights.items():
        if not after.ok:
            (worse_flights if before.ok else failed_as_before).append(f"{name} {after.result}")
        elif after.true > max(_WORSE_FACTOR * before.true, before.true + _WORSE_DISTANCE):
            worse_flights.append(f"{name} {before.true:.3f} -> {after.true:.3f} m")
    problems = [f"flew worse: {'; '.join(worse_flights)}"] if worse_flights else []
    if failed_as_before:
        problems.append(f"failed, as it did without the proposal: {'; '.join(failed_as_before)}")
    if not problems:
        return None
    return f"DO NOT USE THE PROPOSAL: with it the mock vehicle {', and '.join(problems)}"


def _comparison_lines(before: Expectation, after: Expectation) -> list[str]:
    old, new = before.errors, after.errors
    return [
        f"margins, loop opened at the body rate: {before.margins_at_rate.sentence()} -> "
        f"{after.margins_at_rate.sentence()}",
        f"margins, loop opened at the acceleration: {before.margins_at_acceleration.sentence()} -> "
        f"{after.margins_at_acceleration.sentence()}",
        f"position error by gusts {old.gusts:.3f} -> {new.gusts:.3f} m, on a path at 5 m/s "
        f"{old.path:.3f} -> {new.path:.3f} m, by noise {old.noise:.3f} -> {new.noise:.3f} m",
        f"after a gust that adds 1 m/s: {before.peak_error:.2f} -> {after.peak_error:.2f} m from "
        f"the reference, "
        f"settled after {before.settling_time:.1f} -> {after.settling_time:.1f} s",
    ]


def _mismatch_text(mismatch: ModelMismatch) -> str:
    if mismatch.delay:
        return (
            f"with {1e3 * mismatch.delay:.0f} ms of added delay, as at the rate loop's slew limit"
        )
    percent = round(100.0 * abs(mismatch.time_factor - 1.0))
    change = "larger" if mismatch.time_factor > 1.0 else "smaller"
    return f"with lag and dead time {percent} % {change}"


def _flight_line(name: str, before: TrialResult, after: TrialResult) -> str:
    if not (before.ok and after.ok):
        return f"{name}: {before.result} -> {after.result}"
    wind = f" in wind of {after.wind:.1f} m/s" if after.wind else ""
    return (
        f"{name}, flown at up to {after.speed:.1f} m/s{wind}: "
        f"reported {before.reported:.3f} -> {after.reported:.3f}, true "
        f"{before.true:.3f} -> {after.true:.3f} (estimate off by {after.estimate:.3f}), "
        f"rates {degrees(before.rate):.0f} -> {degrees(after.rate):.0f} °/s"
    )


def _reasons(proposal: Proposal) -> dict[str, str]:
    """Reason for the proposed value, by key."""
    untuned, tuned, design = proposal.untuned, proposal.tuned, proposal.design
    max_gain, weights = largest_gain(tuned), hold_weights(untuned)
    is_capped = design.gain > 0.97 * max_gain
    slewing_delay_s = slewing_delay(tuned)
    if is_capped:
        formula = f"{LARGEST_GAIN_TIMES_DELAY} / (lag + dead time)"
        gain_reason = f"the largest sensible gain, {formula} = {max_gain:.2f}"
        if max_gain < sensible_gain(tuned):
            gain_reason = f"the largest gain that is searched, {max_gain:g}"
    elif slewing_delay_s:
        gain_reason = (
            f"below {max_gain:.1f}, the largest sensible gain, because the rate loop needs "
            f"{2e3 * slewing_delay_s:.0f} ms to reach limits.max_tilt_rate_deg_s; tune again after "
            "a change of that limit"
        )
    else:
        gain_reason = f"below {max_gain:.2f}, the largest sensible gain, to keep the margins"
    drag = "as configured, or learned in an earlier flight of this vehicle"
    return {
        "drag_per_s": drag,
        "quadratic_drag_per_m": drag,
        "gain_per_s": f"was {untuned.planner.gain_per_s:g}; {gain_reason}",
        "position_weight_per_s4": f"was {weights.position:.3g}; a stiffer hold tracks better, "
        "a softer one has more margin",
        "velocity_weight_per_s2": f"was {weights.velocity:.3g}; a larger one brings errors of "
        "the estimated velocity into the position",
        "disturbance_bandwidth_rad_s": f"was {disturbance_bandwidth(untuned):.3g}; a quicker "
        "observer sees gusts sooner and brings more noise into the rates",
    }
