"""Runs a campaign on a Dask cluster, and writes the result of each unit when it ends."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from companion.campaign import store
from companion.campaign.campaign import Campaign
from companion.campaign.campaign_file import CampaignFile
from companion.campaign.case import Case
from companion.campaign.cluster import ClusterError, number_of_workers, run_tasks
from companion.campaign.flight import INTERNAL_ERROR
from companion.campaign.folder import Description
from companion.campaign.unit import Row, cases_per_unit, fly_cases, fly_planned_cases, unit_ranges
from companion.campaign.versions import versions

if TYPE_CHECKING:
    from distributed import Client


@dataclass
class Progress:
    """Progress of a campaign."""

    flown_cases: int = 0
    """Number of cases in the results, including those of earlier runs."""
    given_up_units: list[str] = field(default_factory=list)
    """For each unit of work that was given up, a sentence with its cases and the reason."""


def run(
    client: "Client", campaign: Campaign, description: Description, folder: Path
) -> Iterator[Progress]:
    """Run the units of work whose results are missing in the folder, which exists and is locked.

    The results of each unit are written when it ends, completely or not at all. If this function is
    interrupted, only the units that are running are lost.

    Yields:
        the progress, before the first unit and after each unit.

    Raises:
        ClusterError, ConfigError: see `run_tasks`.
        OSError: the results cannot be written.
    """
    units = unit_ranges(description.cases, description.unit)
    finished_units = store.finished_units(folder)
    missing_units = {
        number: unit for number, unit in enumerate(units) if number not in finished_units
    }
    progress = Progress(flown_cases=sum(len(units[number]) for number in finished_units))
    yield progress
    planned_cases = list(campaign.planned_cases()) if missing_units else []
    tasks = {
        number: (fly_planned_cases, campaign, [planned_cases[index] for index in unit], versions())
        for number, unit in missing_units.items()
    }
    for number, result, reason in run_tasks(client, tasks):
        first_case, last_case = units[number][0], units[number][-1]
        if result is None:
            progress.given_up_units.append(
                f"unit {number} (cases {first_case} to {last_case}): {reason}"
            )
        else:
            rows, wall_s, worker = result
            timing = {"first": first_case, "last": last_case, "wall_s": wall_s, "worker": worker}
            store.write_unit(folder, campaign.file, number, rows, timing)
            progress.flown_cases += len(units[number])
        yield progress


def internal_errors(folder: Path, file: CampaignFile) -> Counter[str]:
    """Number of flights that each internal error of the program has ended; empty for a batch."""
    if file.kind != "flights":
        return Counter()
    results = store.read(folder)["result"].to_pylist()
    return Counter(result for result in results if result.startswith(INTERNAL_ERROR))


def run_on_cluster(
    client: "Client", kind: str, cases: Sequence[Case], seconds_per_case: float
) -> list[Row]:
    """Run any cases on the cluster; return their rows in order. Nothing is stored.

    `seconds_per_case` is the wall time that a case takes, s.

    Raises:
        ClusterError: a unit was given up, or the connection to the scheduler is lost.
        ConfigError: see `run_tasks`.
    """
    unit_size = cases_per_unit(len(cases), seconds_per_case, number_of_workers(client))
    units = unit_ranges(len(cases), unit_size)
    tasks = {
        number: (fly_cases, kind, cases[unit.start : unit.stop], versions())
        for number, unit in enumerate(units)
    }
    rows: dict[int, list[Row]] = {}
    for number, result, reason in run_tasks(client, tasks):
        if result is None:
            raise ClusterError(f"some cases could not be flown: {reason}")
        rows[number] = result.rows
    return [row for number in range(len(units)) for row in rows[number]]
