"""The findings of `companion doctor`: tables for the terminal, JSON for programs."""

from collections.abc import Iterable, Sequence
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from companion.config import Config
from companion.preflight.all_checks import not_accepted, overall_result, unsafe
from companion.preflight.finding import Finding
from companion.preflight.parameter_fixes import Outcome
from companion.vehicle.parameter_rules import CheckResult

_TITLES = {
    CheckResult.NOT_CONNECTED: ("NOT CONNECTED: nothing was judged", "bold red"),
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


def tables(config: Config, findings: Sequence[Finding]) -> RenderableType:
    """A table for each result that occurred, the worst first, and a summary line."""
    parts: list[RenderableType] = []
    for result, (title, style) in _TITLES.items():
        matching = [finding for finding in findings if finding.result is result]
        if matching:
            parts.append(_table(title, style, matching, config.flight.accept))
    return Group(*parts, _last_line(config, findings))


def _table(
    title: str, style: str, findings: Iterable[Finding], accepted: Sequence[str]
) -> RenderableType:
    table = Table(title=title, title_justify="left", title_style=style, expand=True)
    table.add_column("found", ratio=3)
    table.add_column("consequence, and what to do", ratio=5)
    table.add_column("source", ratio=2, style="dim")
    for finding in findings:
        excepted = "excepted by flight.accept" if finding.key in accepted else ""
        advice = "; ".join(filter(None, (finding.because, finding.fix, excepted)))
        table.add_row(*map(Text, (finding.found, advice, finding.source)))
    return table


def _last_line(config: Config, findings: Sequence[Finding]) -> Text:
    refused, unsafe_count = not_accepted(config, findings), len(unsafe(findings))
    result = overall_result(config, findings)
    if result is CheckResult.NOT_CONNECTED:
        return Text("not connected: nothing was judged", style="bold red")
    if refused:
        fixable = sum(finding.change is not None for finding in refused)
        fix = f"; `companion doctor --fix` fixes {fixable} of them" if fixable else ""
        return Text(f"{len(refused)} unsafe: `companion fly` refuses{fix}", style="bold red")
    if result is CheckResult.NOT_READY:
        return Text(
            "not ready: run again when the vehicle is ready; some checks could not be made",
            style="bold yellow",
        )
    if unsafe_count:
        return Text(f"{unsafe_count} unsafe, each excepted by flight.accept", style="bold yellow")
    return Text("nothing unsafe was found", style="bold green")


def outcome_line(outcome: Outcome) -> str:
    """The outcome of a change, in one line."""
    change = outcome.change
    if outcome.refusal:
        return f"not set: {outcome.refusal}"
    later = "; takes effect after the autopilot reboots" if change.reboot else ""
    return f"{change.parameter}: {change.old:g} → {change.new:g}, read back{later}"


def as_dict(config: Config, findings: Sequence[Finding]) -> dict[str, Any]:
    """The findings for JSON; `doctor --json` prints them."""
    counts = {
        result.value: sum(finding.result is result for finding in findings) for result in _TITLES
    }
    return {
        "result": _RESULT_WORDS[overall_result(config, findings)],
        **counts,
        "findings": [_finding_as_dict(config, finding) for finding in findings],
    }


def outcome_as_dict(outcome: Outcome) -> dict[str, Any]:
    """The outcome of a change for JSON."""
    return {**outcome.change._asdict(), "refusal": outcome.refusal or None}


def _finding_as_dict(config: Config, finding: Finding) -> dict[str, Any]:
    return {
        "key": str(finding.key),
        "verdict": finding.result.value,
        "accepted": finding.key in config.flight.accept,
        "found": finding.found,
        "because": finding.because,
        "mend": finding.fix,
        "source": finding.source,
        "change": None if finding.change is None else finding.change._asdict(),
    }
