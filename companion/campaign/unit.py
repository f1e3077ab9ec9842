"""A unit of work: cases that one worker flies one after the other."""

from collections.abc import Iterable, Sequence
from time import perf_counter
from typing import NamedTuple

from companion.campaign.campaign import Campaign
from companion.campaign.case import Case
from companion.campaign.design import PlannedCase
from companion.campaign.flight import fly_case, running_worker
from companion.campaign.swept import Value
from companion.campaign.versions import Versions, require_equal, versions

Row = dict[str, Value]
LONGEST_UNIT_S = 2.5
"""Longest planned wall time of a unit with several cases, s.

Such a unit takes much longer than its transfer to a worker, and its loss costs little time."""
_UNITS_PER_WORKER = 4
"""Number of units for each worker in a campaign with few cases, before rounding.

With several units each, all workers end at about the same time. With many cases `LONGEST_UNIT_S`
limits the size of the units instead."""


class UnitResult(NamedTuple):
    """The result that a worker returns for a unit."""

    rows: list[Row]
    """One row for each case, in order."""
    wall_s: list[float]
    """Wall time of each flight, s; of a batch, a single number for all cases together."""
    worker: str
    """Address of the Dask worker."""


def fly_planned_cases(
    campaign: Campaign, planned_cases: Sequence[PlannedCase], client_versions: Versions
) -> UnitResult:
    """Build planned cases, and fly them.

    Raises:
        ConfigError: a case is refused.
        VersionError: the versions of this process differ from the client's.
    """
    return fly_cases(campaign.file.kind, map(campaign.case, planned_cases), client_versions)


def fly_cases(kind: str, cases: Iterable[Case], client_versions: Versions) -> UnitResult:
    """Fly cases, and measure the wall time of each flight, or of a batch as a whole.

    Raises:
        VersionError: the versions of this process differ from the client's.
    """
    worker = running_worker()
    address = "this process" if worker is None else str(worker.address)
    require_equal(client_versions, versions(), f"the worker {address}")
    built_cases = list(cases)
    rows: list[Row] = []
    wall_s: list[float] = []
    for group in [built_cases] if kind == "batch" else [[case] for case in built_cases]:
        start_time = perf_counter()
        rows += run_cases(kind, group)
        wall_s.append(round(perf_counter() - start_time, 4))
    return UnitResult(rows, wall_s, address)


def run_cases(kind: str, cases: Sequence[Case]) -> list[Row]:
    """Run cases in this process; return their rows in order."""
    if kind == "flights":
        return [fly_case(case) for case in cases]
    from companion.campaign import kinematics  # noqa: PLC0415  imports much

    return [kinematics.run_case(case) for case in cases]


def check_cases(kind: str, cases: Sequence[Case]) -> None:
    """Check that cases can be run as this kind of campaign.

    Raises:
        ConfigError: a case cannot be run; the message names it.
    """
    if kind == "batch":
        from companion.campaign import kinematics  # noqa: PLC0415  imports much

        for case in cases:
            kinematics.check_case(case)


def cases_per_unit(cases: int, seconds_per_case: float, workers: int) -> int:
    """The number of cases in a unit of work, if a case takes `seconds_per_case` s of wall time.

    `workers`: number of workers; 0 (the first is still awaited) counts as 1.
    """
    size_by_time = int(LONGEST_UNIT_S / max(seconds_per_case, 1e-6))
    size_by_worker_count = -(-cases // (_UNITS_PER_WORKER * max(1, workers)))
    return max(1, min(size_by_time, size_by_worker_count))


def unit_ranges(cases: int, size: int) -> list[range]:
    """The case numbers of each unit of work, in order; the last unit may be shorter than `size`."""
    return [range(first, min(first + size, cases)) for first in range(0, cases, size)]
