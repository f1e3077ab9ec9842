"""All preflight checks in order, and the rule for findings that forbid a flight."""

from collections.abc import Callable, Iterable, Iterator, Sequence

from companion.config import Config
from companion.preflight import (
    clock_checks,
    configuration_checks,
    link_checks,
    stream_checks,
    vehicle_checks,
)
from companion.preflight.evidence import Evidence
from companion.preflight.finding import Finding
from companion.preflight.offboard_loss import offboard_loss
from companion.preflight.parameters import parameters
from companion.vehicle.parameter_rules import CheckResult

Check = Callable[[Config, Evidence], Iterator[Finding]]

CHECKED_ONCE: tuple[Check, ...] = (
    offboard_loss,
    configuration_checks.planner,
    configuration_checks.dead_time,
    configuration_checks.doubtful_values,
    configuration_checks.identified_autopilot,
    configuration_checks.tilt_compensation,
    configuration_checks.unknown_accept_entries,
)
"""Checks that a flight runs only once, because the vehicle's state does not change their result."""

CHECKS: tuple[Check, ...] = (
    link_checks.signing,
    vehicle_checks.version,
    vehicle_checks.disarmed_on_ground,
    vehicle_checks.battery_charge,
    vehicle_checks.readiness,
    vehicle_checks.gps,
    vehicle_checks.ground,
    vehicle_checks.attitude,
    vehicle_checks.estimator,
    vehicle_checks.fence,
    link_checks.other_nodes,
    stream_checks.streams,
    link_checks.losses,
    link_checks.delays,
    clock_checks.age,
    clock_checks.clocks,
    parameters,
    *CHECKED_ONCE,
)


def run_checks(config: Config, evidence: Evidence, *, repeated: bool = False) -> list[Finding]:
    """Run all checks, without `CHECKED_ONCE` if `repeated`; return all findings, also safe ones."""
    return [
        finding
        for check in CHECKS
        if not (repeated and check in CHECKED_ONCE)
        for finding in check(config, evidence)
    ]


def blocking_findings(config: Config, findings: Sequence[Finding]) -> list[Finding]:
    """The findings that forbid a flight: unsafe and not accepted, or not ready."""
    not_ready = (finding for finding in findings if finding.result is CheckResult.NOT_READY)
    return [*unaccepted_findings(config, findings), *not_ready]


def unaccepted_findings(config: Config, findings: Iterable[Finding]) -> list[Finding]:
    """The unsafe findings that `flight.accept` does not list."""
    return [
        finding for finding in unsafe_findings(findings) if finding.key not in config.flight.accept
    ]


def overall_result(config: Config, findings: Sequence[Finding]) -> CheckResult:
    """The worst result that would stop `companion fly`; SAFE if there is none."""
    results = {finding.result for finding in findings}
    if CheckResult.NOT_CONNECTED in results:
        return CheckResult.NOT_CONNECTED
    if unaccepted_findings(config, findings):
        return CheckResult.UNSAFE
    return CheckResult.NOT_READY if CheckResult.NOT_READY in results else CheckResult.SAFE


def unsafe_findings(findings: Iterable[Finding]) -> list[Finding]:
    """The unsafe findings: somebody may be hurt, or the vehicle lost."""
    return [finding for finding in findings if finding.result is CheckResult.UNSAFE]
