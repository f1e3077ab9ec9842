"""The judgement of the family's parameters, as findings."""

from collections.abc import Iterator

from companion.config import Config
from companion.doctor.evidence import SOME_LOST, Evidence
from companion.doctor.finding import Change, Finding, Key
from companion.doctor.setup import autopilot_setup
from companion.mavlink.parameter_rules import ParameterFinding, ParameterRule, Verdict, judge


def parameters(config: Config, evidence: Evidence) -> Iterator[Finding]:
    """What the parameters that were read say, and what it means that one was not."""
    rules, survey = evidence.family.parameters, evidence.survey
    if not survey.values:
        yield Finding(
            Key.PARAMETERS,
            Verdict.UNSAFE,
            "the autopilot answers no question for a parameter",
            "nothing is known of its failsafes, nor of how it takes a setpoint",
            "let whatever is between (a router, a signing key) pass PARAM messages",
            "PARAM_REQUEST_READ",
        )
        return
    unread = [rule for rule in rules if rule.name not in survey.values]
    for rule in unread:
        if rule.vital:
            yield _missing(rule, evidence.family.name)
    if unread and evidence.link.loss > SOME_LOST:
        yield Finding(
            Key.PARAMETERS,
            Verdict.INEFFECTIVE,
            f"not told: {', '.join(rule.name for rule in unread)}",
            "the autopilot has none of that name, or the link lost the answer; so what they decide "
            "was not looked at",
            "mend the link, or look at them with a ground station",
            "PARAM_REQUEST_READ",
        )
    for found in judge(rules, survey.values, autopilot_setup(config)):
        yield _finding(found, survey.names[found.rule.name])


def _missing(rule: ParameterRule, family: str) -> Finding:
    return Finding(
        rule.name,
        Verdict.UNSAFE,
        f"the autopilot has no parameter {rule.name}, or did not tell it",
        f"it cannot be known {rule.meaning}",
        f"mend the link; where it has none, this needs a newer version of {family}",
        rule.source,
    )


def _finding(found: ParameterFinding, name: str) -> Finding:
    change, mend = None, ""
    if found.set_to is not None:
        change = Change(name, found.value, found.set_to, found.rule.reboot)
        mend = f"set {name} to {found.set_to:g}"
        if found.rule.reboot:
            mend += " and start the autopilot anew"
    return Finding(
        found.rule.name,
        found.verdict,
        f"{name} is {found.value:g}",
        found.because or found.rule.meaning,
        mend,
        found.rule.source,
        change,
    )
