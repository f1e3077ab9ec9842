"""The findings of `companion doctor`: lists for the terminal, JSON for programs."""

from collections.abc import Iterable, Sequence
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from companion.config import Config
from companion.preflight.all_checks import overall_result, unaccepted_findings, unsafe_findings
from companion.preflight.finding import Finding
from companion.preflight.parameter_fixes import ChangeOutcome
from companion.vehicle.parameter_rules import CheckResult

_GROUP_TITLES = {
    CheckResult.NOT_CONNECTED: ("NOT CONNECTED", "bold red"),
    CheckResult.UNSAFE: ("UNSAFE: somebody may be hurt or the vehicle lost", "bold red"),
    CheckResult.INEFFECTIVE: ("INEFFECTIVE: something will not work as configured", "bold yellow"),
    CheckResult.NOT_READY: ("NOT READY: the vehicle cannot be armed yet", "bold yellow"),
    CheckResult.SAFE: ("SAFE", "bold green"),
}

_RESULT_WORDS = {
    CheckResult.NOT_CONNECTED: "not connected",
    CheckResult.UNSAFE: "unsafe",
    CheckResult.NOT_READY: "not ready",
    CheckResult.SAFE: "ok",
}


def findings_lists(config: Config, findings: Sequence[Finding]) -> RenderableType:
    """A list for each result that occurred, the safe ones first, and a summary line.

    The worst findings stand last, beside the summary line, where a terminal shows them.
    """
    parts: list[RenderableType] = []
    for result, (title, style) in reversed(_GROUP_TITLES.items()):
        matching = [finding for finding in findings if finding.result is result]
        if matching:
            parts += [Text(title, style=style), _entries(matching, config.flight.accept), Text()]
    return Group(*parts, _last_line(config, findings))


def _entries(findings: Iterable[Finding], accepted: Sequence[str]) -> RenderableType:
    """One entry for each finding; unless its result is SAFE, remedy and source follow it."""
    table = Table.grid(padding=(0, 1))
    table.add_column()
    table.add_column()
    for finding in findings:
        consequence = f": {finding.consequence}" if finding.consequence else ""
        entry = Text(f"{finding.fact}{consequence}")
        if finding.result is not CheckResult.SAFE:
            if finding.fix:
                entry.append(f"\nWhat to do: {finding.fix}", style="bold")
            if finding.key in accepted:
                entry.append("\nAccepted by flight.accept")
            entry.append(f"\nSource: {finding.source}", style="dim")
        table.add_row("-", entry)
    return table


def _last_line(config: Config, findings: Sequence[Finding]) -> Text:
    unaccepted, unsafe_count = unaccepted_findings(config, findings), len(unsafe_findings(findings))
    result = overall_result(config, findings)
    if result is CheckResult.NOT_CONNECTED:
        return Text("not connected: nothing was checked", style="bold red")
    if unaccepted:
        fixable_count = sum(finding.change is not None for finding in unaccepted)
        fix = f"; `companion doctor --fix` fixes {fixable_count} of them" if fixable_count else ""
        return Text(
            f"{len(unaccepted)} unsafe: `companion fly` refuses to fly{fix}", style="bold red"
        )
    if result is CheckResult.NOT_READY:
        return Text(
            "not ready: run again when the vehicle is ready; some checks could not be made",
            style="bold yellow",
        )
    if unsafe_count:
        return Text(f"{unsafe_count} unsafe, each accepted by flight.accept", style="bold yellow")
    ineffective_count = sum(finding.result is CheckResult.INEFFECTIVE for finding in findings)
    ending = (
        f"; {ineffective_count} ineffective, see above"
        if ineffective_count
        else ": `companion fly` flies this vehicle"
    )
    return Text(f"nothing unsafe was found{ending}", style="bold green")


def outcome_line(outcome: ChangeOutcome) -> str:
    """The outcome of a change, in one line."""
    change = outcome.change
    if outcome.refusal:
        return f"not set: {outcome.refusal}"
    reboot_hint = "; takes effect after the autopilot reboots" if change.reboot else ""
    return f"{change.parameter}: {change.old:g} → {change.new:g}, read back{reboot_hint}"


def as_dict(config: Config, findings: Sequence[Finding]) -> dict[str, Any]:
    """The findings for JSON; `doctor --json` prints them."""
    counts = {
        result.value: sum(finding.result is result for finding in findings)
        for result in _GROUP_TITLES
    }
    return {
        "result": _RESULT_WORDS[overall_result(config, findings)],
        **counts,
        "findings": [_finding_as_dict(config, finding) for finding in findings],
    }


def outcome_as_dict(outcome: ChangeOutcome) -> dict[str, Any]:
    """The outcome of a change for JSON."""
    return {**outcome.change._asdict(), "refusal": outcome.refusal or None}


def _finding_as_dict(config: Config, finding: Finding) -> dict[str, Any]:
    return {
        "key": str(finding.key),
        "result": finding.result.value,
        "accepted": finding.key in config.flight.accept,
        "found": finding.fact,
        "because": finding.consequence,
        "fix": finding.fix,
        "source": finding.source,
        "change": None if finding.change is None else finding.change._asdict(),
    }
