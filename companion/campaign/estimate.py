"""Estimates how long a campaign takes, and compares it with the campaign's limits."""

from collections.abc import Sequence
from dataclasses import replace
from time import perf_counter

from companion.campaign.campaign import Campaign
from companion.campaign.campaign_file import CASE_NOUNS
from companion.campaign.case import Case
from companion.campaign.unit import run_cases
from companion.files.yaml_file import ConfigError

MOST_CASES = {"flights": 2000, "batch": 100_000}
"""Largest number of cases by kind of campaign, where `limits.max_cases` is null."""
_MOST_MEASURED_FLIGHTS = 3
"""Largest number of flights whose time is measured."""
_MOST_MEASURED_VEHICLES = 64
"""Largest number of vehicles in the measured batch.

All measured vehicles have one planner, because compiling a planner takes 2 s."""


def case_time(kind: str, cases: Sequence[Case]) -> float:
    """Measure the mean wall time that a case takes in this process, s, on some of the cases.

    A first run, which imports and compiles, is not measured. For flights this
    first run takes 1 s of vehicle time.
    """
    if kind == "batch":
        planner = cases[0].config.planner_name
        timed_cases = [case for case in cases if case.config.planner_name == planner][
            :_MOST_MEASURED_VEHICLES
        ]
        run_cases(kind, timed_cases)
    else:
        indices = sorted({0, len(cases) // 2, len(cases) - 1})[:_MOST_MEASURED_FLIGHTS]
        timed_cases = [cases[index] for index in indices]
        run_cases(kind, [replace(timed_cases[0], flight_s=1.0)])
    start_time = perf_counter()
    run_cases(kind, timed_cases)
    return (perf_counter() - start_time) / len(timed_cases)


def check_size(campaign: Campaign, seconds_per_case: float, workers: int) -> None:
    """Refuse a campaign that is larger than its limits.

    `seconds_per_case` is the wall time that a case takes, s.

    Raises:
        ConfigError: the campaign is too large; the message names the key that permits more.
    """
    cases, limits = campaign.number_of_cases, campaign.file.limits
    most_allowed = most_cases(campaign)
    seconds = cases * seconds_per_case / workers
    if cases > most_allowed:
        key, allowed = "limits.max_cases", f"{most_allowed}"
    elif seconds > 3600.0 * limits.max_hours:
        key, allowed = "limits.max_hours", f"{limits.max_hours:g}"
    else:
        return
    raise ConfigError(
        f"{campaign.file_path}: {size_text(campaign, seconds, workers)}, more than {key} allows"
        f" ({allowed}); fly fewer cases, raise {key}, or add --yes"
    )


def most_cases(campaign: Campaign) -> int:
    """The largest number of cases that the campaign's limits allow."""
    return campaign.file.limits.max_cases or MOST_CASES[campaign.file.kind]


def size_text(campaign: Campaign, seconds: float, workers: int) -> str:
    """The number of cases, the estimated time (`seconds`), and the number of workers, as text."""
    noun = CASE_NOUNS[campaign.file.kind]
    processes = "1 worker" if workers == 1 else f"{workers} workers"
    return f"{campaign.number_of_cases} {noun}, about {duration_text(seconds)} with {processes}"


def duration_text(seconds: float) -> str:
    """A time in days, h, min or s, rounded to two digits."""
    for unit, unit_s in (("days", 86_400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 1.5 * unit_s:
            rounded_count = float(f"{seconds / unit_s:.2g}")
            return f"{rounded_count:.10g} {unit}"
    return f"{seconds:.2g} s"
