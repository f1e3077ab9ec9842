"""The judgement of the family's parameters, as findings."""

from collections.abc import Iterator

from companion.config import Config
from companion.mavlink.stats import SOME_LOST
from companion.preflight.evidence import Evidence
from companion.preflight.finding import Change, Finding, Key
from companion.preflight.parameter_survey import Survey
from companion.preflight.setup import autopilot_setup
from companion.vehicle.parameter_rules import ParameterFinding, ParameterRule, Verdict, judge


def parameters(config: Config, evidence: Evidence) -> Iterator[Finding]:
    """What the parameters that were read say, and what it means that one was not."""
    rules, survey = evidence.autopilot.parameters, evidence.survey
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
    for rule in rules:
        if rule.vital and rule.name not in survey.values:
            yield _missing(rule, evidence.autopilot.name)
    yield from _untold(evidence)
    for found in judge(rules, survey.values, autopilot_setup(config)):
        yield _finding(found, survey.names[found.rule.name])


def _missing(rule: ParameterRule, autopilot: str) -> Finding:
    return Finding(
        rule.name,
        Verdict.UNSAFE,
        f"the autopilot has no parameter {rule.name}, or did not tell it",
        f"it cannot be known {rule.meaning}",
        f"mend the link; where it has none, this needs a newer version of {autopilot}",
        rule.source,
    )


def _untold(evidence: Evidence) -> Iterator[Finding]:
    """What may have been lost on the way; on a good link it is what this version has not."""
    survey = evidence.survey
    lossy = survey.lossy or evidence.link.loss > SOME_LOST
    rules = [rule for rule in evidence.autopilot.parameters if not rule.vital]
    hidden = [rule for rule in rules if rule.universal and _hidden(rule, survey)]
    unread = [rule.name for rule in hidden]
    if lossy:
        for rule in hidden:
            yield Finding(
                rule.name,
                Verdict.UNSAFE,
                f"{rule.name} was not told, and the link loses frames",
                f"it cannot be known {rule.meaning}",
                "mend the link",
                rule.source,
            )
        others = (rule.name for rule in rules if rule.name in survey.untold)
        unread = [name for name in others if name not in unread]
    if unread:
        yield Finding(
            Key.PARAMETERS,
            Verdict.INEFFECTIVE,
            f"not told: {', '.join(unread)}",
            "the autopilot has none of that name, or the link lost the answer; so what they decide "
            "was not looked at",
            "mend the link, or look at them with a ground station",
            "PARAM_REQUEST_READ",
        )


def _hidden(rule: ParameterRule, survey: Survey) -> bool:
    """Whether it, or what other versions have in its place, exists for all we know, unread."""
    places = {rule.name, rule.instead}
    return places.isdisjoint(survey.values) and not places.isdisjoint(survey.untold)


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
