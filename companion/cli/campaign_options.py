"""The options of `companion campaign` and its sub-commands."""

import argparse
from collections.abc import Sequence

from companion.cli.options import Commands, add_flag, add_path, whole_number_parser

_CAMPAIGN, _RUN = "campaign", "run"
_SUB_COMMANDS = (_RUN, "report", "rerun", "tune", "-h", "--help")


def with_campaign_run(arguments: Sequence[str]) -> list[str]:
    """The arguments, with `campaign FILE` expanded to `campaign run FILE`."""
    words = list(arguments)
    position = next((n for n, word in enumerate(words) if not word.startswith("-")), len(words))
    command, next_word = words[position : position + 1], words[position + 1 : position + 2]
    if command == [_CAMPAIGN] and not set(next_word).intersection(_SUB_COMMANDS):
        words.insert(position + 1, _RUN)
    return words


def add_campaign(commands: Commands) -> None:
    """Add `campaign` with its sub-commands."""
    campaign = commands.add_parser(
        _CAMPAIGN,
        help="fly many flights over swept keys, on all cores or a cluster (extra `campaign`)",
        description="`companion campaign FILE` runs a campaign: flights of the mock vehicle in "
        "memory, over swept keys of the configuration and of the vehicle. Examples of FILE are "
        "in configs/campaigns; docs/campaigns.md explains it.",
    )
    sub_commands = campaign.add_subparsers(required=True, metavar="WHAT")
    _add_run(sub_commands)
    _add_report(sub_commands)
    _add_rerun(sub_commands)
    _add_tune(sub_commands)


def _add_run(sub_commands: Commands) -> None:
    run = sub_commands.add_parser(_RUN, help="run a campaign; the word `run` may be left out")
    add_path(run, "file", "the campaign's file, or the folder of a campaign that was stopped")
    add_path(
        run,
        "--out",
        "folder for the results (runs/campaigns/NAME-TIME); a campaign in it is continued",
        "FOLDER",
    )
    _add_cluster_options(run)
    add_flag(
        run, "--yes", "run the campaign even if it exceeds limits.max_cases or limits.max_hours"
    )
    run.set_defaults(run="campaign.running.run")


def _add_cluster_options(command: argparse.ArgumentParser) -> None:
    """Add `--scheduler` and `--workers`."""
    cluster_or_workers = command.add_mutually_exclusive_group()
    cluster_or_workers.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="run on this Dask cluster, such as tcp://10.0.0.1:8786",
    )
    cluster_or_workers.add_argument(
        "--workers",
        type=whole_number_parser(1, 1024),
        metavar="NUMBER",
        help="worker processes on this computer (one for each core)",
    )


def _add_rerun(sub_commands: Commands) -> None:
    rerun = sub_commands.add_parser(
        "rerun",
        help="fly one case again, with a full recording and its report",
        description="Fly one case of a campaign again, record it as `companion fly` does, write "
        "its report, and check that it is the same flight bit for bit. Exit code 1: the flight "
        "differs.",
    )
    add_path(rerun, "folder", "the campaign's folder", "FOLDER")
    rerun.add_argument(
        "case", type=int, metavar="CASE", help="number of the case (column `case` of the results)"
    )
    rerun.set_defaults(run="cli.flights.rerun")


def _add_report(sub_commands: Commands) -> None:
    report = sub_commands.add_parser(
        "report",
        help="write the page about a campaign, finished or not, and its results as one table",
        description="Write report.html with success rates, worst cases, sensitivity, Pareto front "
        "and distributions, and all results as results.parquet and results.csv in the folder.",
    )
    add_path(report, "folder", "the campaign's folder", "FOLDER")
    add_path(report, "--out", "the page (FOLDER/report.html)")
    report.set_defaults(run="campaign.report.page.run")


def _add_tune(sub_commands: Commands) -> None:
    tune = sub_commands.add_parser(
        "tune",
        help="search limits, gains and weights over the flights of a campaign",
        description="Search the keys in `tune.search` of the campaign's file for the smallest true "
        "error that keeps tune.inside_share. Compare the result with the configuration before the "
        "search, on flights that the search has not seen. Write the result as YAML, with its "
        "reasons. A search that was stopped is continued.",
    )
    add_path(tune, "file", "a campaign's file with `tune:`")
    add_path(tune, "--out", "folder for the search (runs/campaigns/NAME-tune)", "FOLDER")
    tune.add_argument(
        "--trials",
        type=whole_number_parser(1, 100_000),
        metavar="NUMBER",
        help="number of trials; replaces tune.trials of the file",
    )
    _add_cluster_options(tune)
    tune.set_defaults(run="campaign.tune.command.run")
