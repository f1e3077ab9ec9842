"""`companion campaign tune`: searches, checks the result on unseen cases, and writes the result."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import TextColumn

from companion.campaign import engine, estimate, folder
from companion.campaign.campaign import Campaign
from companion.campaign.campaign_file import Tune
from companion.campaign.case import Case
from companion.campaign.cluster import (
    ClusterError,
    cluster_client,
    require_packages,
    wait_for_workers,
)
from companion.campaign.loading import load
from companion.campaign.running import DONE, FAILED, interruptible, progress_bar
from companion.campaign.tune.candidates import (
    cases,
    configured_values,
    start_candidates,
    tune_section,
    unseen_campaign,
)
from companion.campaign.tune.certainty import compare
from companion.campaign.tune.scores import Row, SearchResults, score_of
from companion.campaign.tune.search import Fly, Search, StorageError
from companion.campaign.tune.writing import (
    CheckedResult,
    best_so_far_text,
    result_text,
    summary_lines,
)
from companion.extras import require
from companion.files.write_whole import write_whole
from companion.files.yaml_file import ConfigError
from companion.program_command import program_command

if TYPE_CHECKING:
    from distributed import Client

RESULT_FILE_NAME = "tuned.yaml"
"""Name of the result file in the folder of the search."""


def run(options: argparse.Namespace) -> int:
    """Begin or continue a search; return the exit code.

    Raises:
        ConfigError: the file is wrong, or the folder cannot be used.
        MissingExtraError: the extra `campaign` is missing.
    """
    require_packages()
    require("optuna", "campaign", "`companion campaign tune`")
    campaign = load(options.file)
    tune = tune_section(campaign)
    search_folder: Path = options.out or folder.CAMPAIGNS_FOLDER / f"{campaign.file.name}-tune"
    console = Console(highlight=False, soft_wrap=True, markup=False)
    for start in start_candidates(campaign, tune):
        cases(campaign, start.values)  # refuses a bad value before any work
    with folder.lock(search_folder):
        try:
            _begin(search_folder, campaign)
            with interruptible(), cluster_client(options.scheduler, options.workers) as client:
                wait_for_workers(client)
                console.print(f"Dask's dashboard: {client.dashboard_link}")
                fly = _fly_function(client, campaign)
                try:
                    search = Search(campaign, tune, search_folder, fly)
                except StorageError as error:  # there are no candidates to continue with
                    raise ConfigError(str(error)) from error
                results = _run_search(search, options.trials or tune.trials, console)
                return _check_and_write(campaign, tune, search_folder, fly, results, console)
        except (KeyboardInterrupt, ClusterError, StorageError) as error:
            reason = "interrupted" if isinstance(error, KeyboardInterrupt) else str(error)
            command = program_command(
                *("campaign", "tune", options.file, "--out", search_folder),
                *(("--trials", str(options.trials)) if options.trials else ()),
                *(("--scheduler", options.scheduler) if options.scheduler else ()),
            )
            console.print(f"{reason}; the candidates so far are kept. Continue with\n  {command}")
            return FAILED


def _begin(search_folder: Path, campaign: Campaign) -> None:
    """Make the folder of the search, or check that it holds this search."""
    if folder.holds_campaign(search_folder):
        folder.resume(search_folder, campaign)
    else:
        folder.make(search_folder, campaign, folder.describe(campaign, 1, None))


def _fly_function(client: "Client", campaign: Campaign) -> Fly:
    """A function that flies cases on the cluster; the time of a case is measured here first."""
    kind = campaign.file.kind
    seconds_per_case = estimate.case_time(kind, list(campaign.cases())[:1])

    def fly(cases_to_fly: Sequence[Case]) -> Sequence[Row]:
        return engine.run_on_cluster(client, kind, cases_to_fly, seconds_per_case)

    return fly


def _run_search(search: Search, trials: int, console: Console) -> SearchResults:
    """Search with a progress bar; if the storage fails, print the best candidate so far and raise.

    `trials` includes the candidates of earlier runs.
    """
    results = SearchResults()
    best_column = TextColumn("{task.description}")
    try:
        with progress_bar(console, TextColumn("candidates"), best_column) as bar:
            task = bar.add_task("", total=trials)
            for results in search.run(trials):
                best_text = "" if results.best is None else f"best {results.best.score.rms:.3f} m"
                bar.update(task, completed=results.tried_count, description=best_text)
    except (StorageError, OSError):
        if results.best is not None:
            console.print(best_so_far_text(results.best), end="")
        raise
    return results


def _check_and_write(
    campaign: Campaign,
    tune: Tune,
    search_folder: Path,
    fly: Fly,
    results: SearchResults,
    console: Console,
) -> int:
    """Check the best candidate on unseen cases, write it, and report the outcome.

    Returns:
        the exit code: `FAILED` if no candidate met the constraint (`inside_share`), else `DONE`.

    Raises:
        OSError: the result cannot be written; it was printed instead.
    """
    if results.best is None:
        console.print(
            f"None of the {results.tried_count} candidates kept {tune.inside_share:.1%} of the "
            "flights inside the envelope: widen tune.search or tune.envelope_m, or raise "
            "tune.trials."
        )
        return FAILED
    check_campaign = unseen_campaign(campaign, tune.check_samples)
    console.print(
        f"checking on {check_campaign.number_of_cases} flights that the search has not seen…"
    )
    before = score_of(fly(list(check_campaign.cases())), tune.envelope_m)
    after = score_of(fly(cases(check_campaign, results.best.values)), tune.envelope_m)
    comparison = compare(before, after, tune.check_samples)
    result = CheckedResult(campaign, results, results.best, before, after, comparison)
    path = search_folder / RESULT_FILE_NAME
    text = result_text(result, configured_values(campaign.base, tune.search))
    for line in summary_lines(result):
        console.print(line)
    try:
        write_whole(path, text)
    except OSError:  # hours of flights must not be lost for want of a file
        console.print(text, end="")
        raise
    console.print(f"Written to {path}; let your configuration include it.")
    return DONE
