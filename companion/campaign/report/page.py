"""`companion campaign report`: the page about a campaign, and its results in one table."""

import argparse
from collections import Counter
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from companion.campaign.campaign import Campaign
from companion.campaign.cluster import require_packages
from companion.campaign.folder import CAMPAIGN_FILE_NAME
from companion.campaign.loading import load
from companion.campaign.report import plots, tables
from companion.campaign.report.results import RATE_OUTCOME, TRUE_ERROR, Results, label
from companion.campaign.report.sensitivity import FEWEST_CASES, Influence, influences
from companion.campaign.report.statistics import levels, share_of
from companion.extras import require
from companion.files.write_whole import write_whole
from companion.files.yaml_file import ConfigError
from companion.program_command import program_command
from companion.report import PAGE
from companion.report.html_page import rendered_page, require_extra

if TYPE_CHECKING:
    import pyarrow as pa

PARQUET, CSV = "results.parquet", "results.csv"
_MOST_GRID_VALUES = 12
"""With at most this many different values, a sampled factor is judged like the values of a grid."""
_ENOUGH_SAMPLES = 60
"""With fewer different values, the influences of sampled factors cannot be told apart."""


def run(options: argparse.Namespace) -> int:
    """Write the page and the tables of a campaign; returns the exit code.

    Raises:
        ConfigError: the folder holds no campaign or no results yet, or a file in it is damaged, or
            the page cannot be written.
        MissingExtraError: an extra is missing.
        OSError: the tables cannot be written.
    """
    require_packages()
    require("SALib", "campaign", "`companion campaign report`")
    require_extra()
    results = Results.read(options.folder)
    page = options.out or options.folder / PAGE
    text = page_text(results, load(options.folder / CAMPAIGN_FILE_NAME))
    try:
        write_whole(page, text)
    except OSError as error:
        raise ConfigError(f"{page}: cannot write there: {error.strerror}") from error
    write_tables(results.table, options.folder)
    console = Console(highlight=False, soft_wrap=True, markup=False)
    console.print(headline(results))
    for line in missing_cases_note(results):
        console.print(line)
    console.print(f"Open {page}")
    return 0


def write_tables(table: "pa.Table", folder: Path) -> None:
    """Write all results as one Parquet file and as CSV.

    Raises:
        OSError: a file cannot be written.
    """
    import pyarrow.csv  # noqa: PLC0415  an extra
    import pyarrow.parquet  # noqa: PLC0415

    for name, write in ((PARQUET, pyarrow.parquet.write_table), (CSV, pyarrow.csv.write_csv)):
        content = BytesIO()
        write(table, content)
        write_whole(folder / name, content.getvalue())


def page_text(results: Results, campaign: Campaign) -> str:
    """The HTML of the page about a campaign as stored in its folder."""
    influences_by_outcome = {
        name: found_influences
        for name in (results.error_outcome, RATE_OUTCOME, "ok")
        if name == "ok" or results.is_measured(name)
        if (found_influences := influences(results, name))
    }
    factor_order = _factors_by_influence(results, influences_by_outcome)
    shown_plots = [
        *plots.success(results, factor_order),
        *plots.sensitivity(influences_by_outcome),
        *plots.pareto(results),
        *plots.distributions(results),
    ]
    first_tables = [tables.worst_cases(results), tables.two_factors(results)]
    if factor_order:
        first_tables.append(tables.success_by_factor(results, factor_order))
    if influences_by_outcome:
        first_tables.append(tables.sensitivity(influences_by_outcome))
    return rendered_page(
        "companion.campaign.report",
        "campaign.html.j2",
        f"Campaign {results.name}",
        shown_plots,
        headline=headline(results),
        good=not results.crashed_count and bool(_successes(results).all()),
        lines=[*missing_cases_note(results), *summary_sentences(results, influences_by_outcome)],
        tables=[table for table in first_tables if table is not None],
        last=[tables.configuration(campaign), tables.all_cases(results)],
    )


def headline(results: Results) -> str:
    """One sentence: how many cases were flown, and the success rate with its interval.

    Success is a good flight or, if every case has a fault, an ending as documented for the fault.
    """
    share = share_of(_successes(results))
    success = "with a fault ended as documented" if results.all_faulty else "good"
    return f"{results.name}: {share.case_count} of {share.total} {results.noun} {success}: {share}"


def _successes(results: Results) -> NDArray[np.bool_]:
    """(cases,): whether each case was a success in the sense of `headline`."""
    return results.as_documented if results.all_faulty else results.good


def missing_cases_note(results: Results) -> list[str]:
    """One sentence: how many cases are missing and how to continue; empty if all are flown."""
    unflown_count = results.planned_count - results.count
    if not unflown_count:
        return []
    return [
        f"{unflown_count} of {results.planned_count} {results.noun} are missing. "
        f"`{program_command('campaign', results.folder)}` goes on with them."
    ]


def summary_sentences(
    results: Results, influences_by_outcome: dict[str, list[Influence]]
) -> Iterator[str]:
    """The sentences at the head of the page: what was swept, and the most important results.

    `influences_by_outcome` holds the influences of the factors on each outcome, the largest first.
    """
    yield f"Swept: {', '.join(results.factors) or 'nothing but noise and gusts'}."
    if crashed_count := results.crashed_count:
        yield (
            f"{crashed_count} {results.noun} crashed; they stand first in the table of worst cases."
        )
    if results.all_faulty:
        yield f"{results.good.sum()} of {results.count} flights were good in spite of the fault."
    elif results.as_documented.size:
        documented_count, faulty_count = results.as_documented.sum(), results.as_documented.size
        yield f"{documented_count} of {faulty_count} flights with a fault ended as documented."
    reasons = Counter(results.reason(row) for row in range(results.count) if not results.good[row])
    if reasons:
        reason, count = reasons.most_common(1)[0]
        yield f"Most frequent reason why a case was not good, {count} times: {reason}."
    yield from _influence_sentences(results, influences_by_outcome)
    if results.error_outcome == TRUE_ERROR:
        yield (
            "Errors are distances of the true vehicle from the reference. A flight knows only the "
            "autopilot's estimate, so its own report shows the error estimated_rms_m."
        )


def _influence_sentences(
    results: Results, influences_by_outcome: dict[str, list[Influence]]
) -> Iterator[str]:
    if results.error_outcome in influences_by_outcome:
        strongest = influences_by_outcome[results.error_outcome][0]
        error = label(results.error_outcome).partition(",")[0]
        variance_share = f"{strongest.sobol_index:.0%} ± {strongest.confidence:.0%}"
        yield (
            f"{strongest.factor} explains {variance_share} of the variance of the {error} by "
            "itself."
        )
        yield from _few_samples_warning(results)
    elif results.factors:
        yield f"Sensitivity needs at least {FEWEST_CASES} {results.noun} with different outcomes."
    lowest_success = min(
        (
            (share_of(results.good[level.cases]), name, level.name)
            for name in results.factors
            for level in levels(results.columns[name])
            if level.cases.any()
        ),
        default=None,
        key=lambda item: item[0].high,
    )
    if lowest_success is not None and lowest_success[0].share < np.mean(results.good):
        success_share, name, value = lowest_success
        yield f"Success is lowest with {name} = {value}: {success_share}."


def _few_samples_warning(results: Results) -> Iterator[str]:
    """A warning if the sampled factors took few different values."""
    distinct_counts = [
        len(np.unique(column))
        for name, factor in results.factors.items()
        if factor["sampled"] and (column := results.columns[name]).dtype == float
    ]
    largest_count = max(distinct_counts, default=0)
    if _MOST_GRID_VALUES < largest_count < _ENOUGH_SAMPLES:
        yield (
            f"Only {largest_count} different samples of the distributions were flown, too few to "
            "tell the influences of the sampled factors apart; raise `samples`."
        )


def _factors_by_influence(
    results: Results, influences_by_outcome: dict[str, list[Influence]]
) -> list[str]:
    """The factors by influence on success, then on the error; those without influence last."""
    influential = [
        influence.factor
        for name in ("ok", results.error_outcome)
        for influence in influences_by_outcome.get(name, ())
    ]
    return list(dict.fromkeys([*influential, *results.factors]))
