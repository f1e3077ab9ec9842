"""All checks in their order, and what a flight makes of what they find: the one place for both."""

from collections.abc import Callable, Iterable, Iterator

from companion.config import Config
from companion.doctor import configuration_checks, link_checks, vehicle_checks
from companion.doctor.evidence import Evidence
from companion.doctor.finding import Finding, Key
from companion.doctor.parameter_findings import parameters
from companion.mavlink.parameter_rules import Verdict

Check = Callable[[Config, Evidence], Iterator[Finding]]

CHECKS: tuple[Check, ...] = (
    vehicle_checks.version,
    vehicle_checks.motors,
    vehicle_checks.power,
    vehicle_checks.readiness,
    vehicle_checks.gps,
    vehicle_checks.ground,
    vehicle_checks.estimator,
    vehicle_checks.fence,
    link_checks.company,
    link_checks.signing,
    link_checks.streams,
    link_checks.losses,
    link_checks.delays,
    link_checks.clocks,
    parameters,
    configuration_checks.planner,
    configuration_checks.dead_time,
    configuration_checks.accepted,
)


def examine(config: Config, evidence: Evidence) -> list[Finding]:
    """All that is found, safe things included."""
    return [finding for check in CHECKS for finding in check(config, evidence)]


def forbidding(config: Config, findings: Iterable[Finding]) -> list[Finding]:
    """What is unsafe and not excepted by `flight.accept`: with any of these nothing is flown."""
    return [finding for finding in unsafe(findings) if finding.key not in config.flight.accept]


def lacking(findings: Iterable[Finding]) -> list[Finding]:
    """What a flight cannot begin without, though the doctor need not call it unsafe to lack it."""
    return [
        finding
        for finding in findings
        if finding.key in (Key.READY, Key.LANDED) and finding.verdict is Verdict.INEFFECTIVE
    ]


def unsafe(findings: Iterable[Finding]) -> list[Finding]:
    """Of the findings those by which somebody may be hurt or the vehicle lost."""
    return [finding for finding in findings if finding.verdict is Verdict.UNSAFE]
