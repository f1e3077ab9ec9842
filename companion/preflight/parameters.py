"""Findings about the autopilot's parameters."""

from collections.abc import Iterator

from companion.config import Config
from companion.mavlink.stats import TOLERABLE_LOSS
from companion.preflight.evidence import Evidence
from companion.preflight.finding import Finding, Key, ParameterChange
from companion.preflight.parameter_survey import Survey
from companion.vehicle.parameter_rules import (
    CheckResult,
    CompanionSettings,
    ParameterFinding,
    ParameterRule,
    apply_rules,
)


def companion_settings(config: Config) -> CompanionSettings:
    """The part of our configuration that the autopilot's parameters must agree with, in SI."""
    limits = {name: axis.acceleration_limit for name, axis in config.vehicle.axes.items()}
    return CompanionSettings(
        source_system=config.link.source_system,
        attitude_rate_hz=config.link.attitude_rate_hz,
        silence_limit=config.deadman.silence_limit,
        hover_thrust=config.thrust.hover_thrust,
        curve_factor=config.thrust.curve_factor,
        battery_exponent=config.thrust.battery_exponent,
        autopilot_compensates_tilt=config.thrust.autopilot_compensates_tilt,
        acceleration_limits=limits,
        max_tilt=config.limits.max_tilt,
        signing=config.link.signing_key_file is not None,
    )


def parameters(config: Config, evidence: Evidence) -> Iterator[Finding]:
    """Judge the values of the parameters, and report parameters that were not received."""
    rules, survey = evidence.autopilot.parameters, evidence.survey
    if not survey.values:
        yield Finding(
            Key.PARAMETERS,
            CheckResult.UNSAFE,
            "the autopilot answers no parameter request",
            "its failsafes and its handling of setpoints are unknown",
            "check that no router or signing key on the way blocks PARAM messages",
            "PARAM_REQUEST_READ",
        )
        return
    for rule in rules:
        if rule.vital and rule.name not in survey.values:
            yield _unknown_value_finding(
                rule,
                f"the autopilot has no parameter {rule.name}, or did not send it",
                "fix the link; if the autopilot really has no such parameter, update "
                + evidence.autopilot.name,
            )
    yield from _missing_parameters(evidence)
    for result in apply_rules(rules, survey.values, companion_settings(config)):
        yield _finding(result, survey.present_names[result.rule.name])


def _unknown_value_finding(rule: ParameterRule, fact: str, fix: str) -> Finding:
    consequence = f"it is unknown {rule.meaning}"
    return Finding(rule.name, CheckResult.UNSAFE, fact, consequence, fix, rule.source)


def _missing_parameters(evidence: Evidence) -> Iterator[Finding]:
    """Findings about parameters that were not received.

    If the link loses frames, a missing parameter that every version of the autopilot has is unsafe.
    One finding names all other missing parameters.
    """
    survey = evidence.survey
    link_loses_frames = survey.link_loses_frames or evidence.link.loss > TOLERABLE_LOSS
    rules = [rule for rule in evidence.autopilot.parameters if not rule.vital]
    unread_rules = [
        rule for rule in rules if rule.in_all_versions and _may_exist_unread(rule, survey)
    ]
    missing_names = [rule.name for rule in unread_rules]
    if link_loses_frames:
        for rule in unread_rules:
            fact = f"{rule.name} was not received, and the link loses frames"
            yield _unknown_value_finding(rule, fact, "fix the link")
        unread_names = (rule.name for rule in rules if rule.name in survey.unread_names)
        missing_names = [name for name in unread_names if name not in missing_names]
    if missing_names:
        yield Finding(
            Key.PARAMETERS,
            CheckResult.INEFFECTIVE,
            f"parameters not received: {', '.join(missing_names)}",
            "the autopilot has no such parameter, or the link lost the answer; so their values "
            "were not checked",
            "fix the link, or check them with a ground station",
            "PARAM_REQUEST_READ",
        )


def _may_exist_unread(rule: ParameterRule, survey: Survey) -> bool:
    """Whether the autopilot may have the rule's parameter, although the survey did not read it."""
    names = {rule.name, rule.alternative}
    return names.isdisjoint(survey.values) and not names.isdisjoint(survey.unread_names)


def _finding(result: ParameterFinding, name: str) -> Finding:
    change, fix = None, ""
    if result.set_to is not None:
        change = ParameterChange(name, result.value, result.set_to, result.rule.needs_reboot)
        fix = f"set {name} to {result.set_to:g}"
        if result.rule.needs_reboot:
            fix += " and restart the autopilot"
    return Finding(
        result.rule.name,
        result.result,
        f"{name} is {result.value:g}",
        result.consequence or result.rule.meaning,
        fix,
        result.rule.source,
        change,
    )
