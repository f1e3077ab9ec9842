"""What `companion doctor` prints: a list for each result, the worst last, within 80 columns."""

from io import StringIO

from rich.console import Console

from companion.config import Config
from companion.config.files import changed
from companion.preflight.finding import Finding, Key
from companion.preflight.report import findings_lists
from companion.vehicle.parameter_rules import CheckResult

FINE = Finding(Key.BATTERY, CheckResult.SAFE, "battery at 90 %", source="BATTERY_STATUS")
WEAK = Finding(Key.RESPONSE, CheckResult.INEFFECTIVE, "the gain is 8", "it overshoots", "lower it")
BAD = Finding(Key.LOSS, CheckResult.UNSAFE, "20 % lost " * 9, "late", "a better link", "counted")


def shown(findings: list[Finding], config: Config | None = None) -> list[str]:
    console = Console(width=80, record=True, file=StringIO())
    console.print(findings_lists(Config() if config is None else config, findings))
    return [line.rstrip() for line in console.export_text().splitlines()]


def test_the_worst_stands_last_with_its_remedy_beside_the_summary() -> None:
    lines = shown([BAD, WEAK, FINE])
    assert lines[:3] == ["SAFE", "- battery at 90 %", ""]
    assert lines[3].startswith("INEFFECTIVE")
    assert lines[4:6] == ["- the gain is 8: it overshoots", "  What to do: lower it"]
    assert lines[-4:] == [
        *("  What to do: a better link", "  Source: counted", ""),
        "1 unsafe: `companion fly` refuses to fly",
    ]
    assert max(map(len, lines)) <= 80


def test_without_anything_unsafe_the_summary_says_that_it_may_be_flown() -> None:
    assert shown([FINE])[-1] == "nothing unsafe was found: `companion fly` flies this vehicle"
    assert shown([FINE, WEAK])[-1] == "nothing unsafe was found; 1 ineffective, see above"


def test_an_accepted_finding_says_so() -> None:
    accepted = changed(Config(), {"flight": {"accept": [str(BAD.key)]}}, "test")
    lines = shown([BAD], accepted)
    assert "  Accepted by flight.accept" in lines
    assert lines[-1] == "1 unsafe, each accepted by flight.accept"
