"""The summary in words at the end of a flight.

The summary says which maneuvers were flown, whether all figures are within their limits, and what
to do next.
"""

import shlex
from collections.abc import Sequence
from typing import Any, NamedTuple

from companion.recording.measurements.verdict import (
    LATENCY,
    LOST_ROWS,
    OFF_COURSE,
    Check,
    Figures,
    checks,
    cut_step_checks,
    is_good,
)
from companion.recording.what_to_do import what_to_do

_PHASES_BEFORE_TAKEOFF = ("connect", "checks", "stream", "arm", "hand over")
_SHARED_OPTIONS = ("--endpoint", "--set")
_SLOW_COMPUTER_MONITORS = ("deadlines", "starvation", "answer gaps", "answer rate")
"""Monitors that a slow computer breaches if the vehicle runs on the same computer."""
_LYING_TILT_DEG = 40.0
"""Tilt beyond which a disarmed vehicle does not stand on its legs, °."""
STOPPED_BY_USER = "stopped at once by the user"
"""Result of a flight that was cancelled, for example by Ctrl-C in a user's program."""
_INTERRUPTED = ("interrupted by ", STOPPED_BY_USER)


class Invocation(NamedTuple):
    """The command line of the program, from which the suggested next command is made."""

    program: str
    """Name or path by which a shell finds the program."""
    arguments: Sequence[str]
    """Arguments of the command that flew."""
    config: str | None
    """Configuration file of the flight; None: the demo's own."""


class ClosingWords(NamedTuple):
    """The summary of a flight in words."""

    headline: str
    """Which maneuvers were flown, and whether all figures are within limits; or the early end."""
    lines: tuple[str, ...]
    """The figures and advice for the headline, or how and why the flight ended early."""
    next_command: str | None
    """Suggested next command line, or None."""
    was_good: bool
    """Whether the flight was good; see `is_good`."""
    completed: bool
    """Whether the maneuvers were flown to their end."""


def closing_words(figures: Figures, invocation: Invocation | None) -> ClosingWords:
    """The summary in words for the figures of a flight.

    Args:
        figures: result of `Summary.as_dict`.
        invocation: see `Invocation`; None: no next command is suggested.
    """
    completed, good = figures["result"] == "ok", is_good(figures)
    headline, lines = _headline_and_reasons(figures) if completed else _early_end_text(figures)
    return ClosingWords(
        headline,
        tuple(lines),
        None if invocation is None else _next_command(figures, invocation),
        good,
        completed,
    )


def _headline_and_reasons(figures: Figures) -> tuple[str, list[str]]:
    flight_checks, advice = checks(figures), list(figures["advice"])
    failed_checks = [check for check in flight_checks if not check.good]
    names = _joined_by_and([maneuver["name"] for maneuver in figures["maneuvers"]])
    if is_good(figures):
        headline = f"The flight was good: {names}, every figure within its limit."
    elif failed_checks:
        headline = (
            f"The flight was not good: {names}, {len(failed_checks)} of {len(flight_checks)} "
            "figures beyond their limits."
        )
    elif all(LOST_ROWS in text for text in advice):
        headline = f"The flight was good, as far as it could be recorded: {names}."
    else:
        headline = f"The flight was good, but the configuration does not fit the vehicle: {names}."
    lines = _failed_check_lines(failed_checks)
    lines += [f"! {text}" for text in (*advice, *_gain_warning(figures))]
    lines += _passed_check_lines([check for check in flight_checks if check.good])
    lines += [] if figures.get("drag_learned") is None else [f"  {figures['drag_learned']}"]
    return headline, [*lines, _extent_line(figures)]


def _failed_check_lines(failed_checks: list[Check]) -> list[str]:
    return [f"! {check.what}: {check.found}; {check.remedy}" for check in failed_checks]


def _passed_check_lines(passed_checks: Sequence[Check]) -> list[str]:
    """One line for each `Check.what` of the passed checks, with the figures of these checks."""
    figures_by_subject: dict[str, list[str]] = {}
    for check in passed_checks:
        figures_by_subject.setdefault(check.what, []).append(check.found)
    return [f"  {what}: {'; '.join(words)}" for what, words in figures_by_subject.items()]


def _extent_line(figures: Figures) -> str:
    extent = figures["extent"]
    # After a full disk the figures count only what was recorded.
    at_least = "at least " if any(LOST_ROWS in text for text in figures["advice"]) else ""
    under_control = f"{extent['under_control_s']:.0f} s under our control"
    parts = [f"{at_least}{under_control} by planner {figures['planner']}"]
    for key, words in (
        ("height_max_m", "up to {:.1f} m high"),
        ("maneuver_speed_max_m_s", "{:.1f} m/s fast"),
        ("maneuver_tilt_max_deg", "{:.0f}° tilted"),
    ):
        if extent.get(key) is not None:  # an older summary has no figures of the maneuvers
            parts.append(words.format(extent[key]))
    return f"  {', '.join(parts)}"


def _early_end_text(figures: Figures) -> tuple[str, list[str]]:
    early_end = figures["early_end"]
    interrupted = figures["result"].startswith(_INTERRUPTED)
    advice = what_to_do(early_end["monitor"], early_end["phase"], figures["result"])
    remedy = "nothing needs fixing" if interrupted else advice
    if figures["at_the_end"]["armed"]:
        on_ground = early_end["since_takeoff_s"] is None  # or no lift-off was reported
        first_step = (
            "disarm it, or take it over if it flies" if on_ground else "take it over or land it"
        )
        next_step = "" if interrupted else f"; then: {remedy}"
        is_heard = figures["at_the_end"].get("unheard_s") is None
        armed = "is armed" if is_heard else "was armed when last heard"
        remedy = f"the vehicle {armed}: {first_step}{next_step}"
    result = figures["result"].rstrip(".")
    return f"The flight ended early: {result}{'' if result.endswith('?') else '.'}", [
        f"  when: {_end_time_text(early_end)}",
        f"  {_vehicle_state_text(figures)}",
        f"  what to do: {remedy}",
        *(f"! {text}" for text in (*figures["advice"], *_gain_warning(figures))),
        *_failed_check_lines(cut_step_checks(figures)),
    ]


def _gain_warning(figures: Figures) -> list[str]:
    """The warning that the planner's gain is too high; empty: no warning."""
    warning = figures.get("gain_warning")
    return [] if warning is None else [warning]


def _end_time_text(early_end: dict[str, Any]) -> str:
    words = f"at {early_end['time_s']:.1f} s, in phase `{early_end['phase']}`"
    if early_end["since_takeoff_s"] is None:
        # In later phases the vehicle may fly although no lift-off was reported.
        is_on_ground = early_end["phase"] in _PHASES_BEFORE_TAKEOFF
        words += ", before take-off" if is_on_ground else ", before any report of lift-off"
    if early_end["maneuver"] is not None:
        words += f", {early_end['into_maneuver_s']:.1f} s into {early_end['maneuver']}"
    return words


def _vehicle_state_text(figures: Figures) -> str:
    state = figures["at_the_end"]
    silence = state.get("unheard_s")  # s; None: the vehicle was heard
    when_text = "now" if silence is None else f"when last heard, {silence:.1f} s before the end"
    armed = {True: "ARMED", False: "disarmed", None: "not known whether armed"}[state["armed"]]
    mode = "" if state["mode"] is None else f", in mode {state['mode']}"
    tilt = state.get("tilt_deg") or 0.0  # an older summary has none
    lies = state["armed"] is False and tilt > _LYING_TILT_DEG
    damage = (
        f", tilted by {tilt:.0f}°: it tipped over or crashed; pull the battery's plug before you "
        "touch it"
    )
    return f"vehicle {when_text}: {armed}{mode}{damage if lies else ''}"


def _next_command(figures: Figures, invocation: Invocation) -> str | None:
    def command(*words: str) -> str:
        return f"{invocation.program} {shlex.join(words)}"

    arguments = invocation.arguments
    config_options = None
    if invocation.config is not None:
        config_options = ["--config", invocation.config, *_shared_options(arguments)]
    if figures["result"].startswith(_INTERRUPTED) or _repetition_is_better(figures):
        return command(*arguments)
    early_end = figures["early_end"]
    if (
        early_end is not None
        and early_end["phase"] in _PHASES_BEFORE_TAKEOFF
        and early_end["since_takeoff_s"] is None
    ):
        return None if config_options is None else command("doctor", *config_options)
    if arguments[:1] == ["demo"] and _computer_was_slow(figures):
        return command(*arguments, "--lockstep")
    if early_end is None and figures["settings"]:
        changes = [f"{key}={value}" for key, value in figures["settings"].items()]
        return command(*arguments, *(word for change in changes for word in ("--set", change)))
    if early_end is None and config_options is not None and figures["planner"] == "first-order":
        return command("identify", *config_options)
    return command("plot", figures["log"]) if figures["log"] is not None else None


def _repetition_is_better(figures: Figures) -> bool:
    """Whether the same flight would now be better, because the vehicle's drag has been learned."""
    if figures["early_end"] is not None or figures["settings"] or not figures.get("drag_learned"):
        return False
    return any(not check.good and check.fault.endswith(OFF_COURSE) for check in checks(figures))


def _computer_was_slow(figures: Figures) -> bool:
    """Whether the computer was too slow for a flight in real time; never in lockstep."""
    if figures["lockstep"]:
        return False
    early_end = figures["early_end"]
    if early_end is not None and early_end["monitor"] is not None:
        return early_end["monitor"] in _SLOW_COMPUTER_MONITORS
    return any(check.what == LATENCY and not check.good for check in checks(figures))


def _shared_options(arguments: Sequence[str]) -> list[str]:
    """The options that changed the configuration and that other commands take as well."""
    shared_options: list[str] = []
    for argument, next_argument in zip(arguments, (*arguments[1:], ""), strict=True):
        if argument in _SHARED_OPTIONS:
            shared_options += (argument, next_argument)
        elif argument.partition("=")[0] in _SHARED_OPTIONS:
            shared_options.append(argument)
    return shared_options


def _joined_by_and(names: Sequence[str]) -> str:
    if not names:
        return "no maneuver"
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
