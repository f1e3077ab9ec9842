"""`companion campaign FILE`: checks, estimates and runs the campaign, and tells how to continue."""

import argparse
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, NoReturn

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from companion.campaign import engine, estimate, folder, store
from companion.campaign.campaign import Campaign
from companion.campaign.campaign_file import CASE_NOUNS
from companion.campaign.cluster import (
    ClusterError,
    cluster_client,
    number_of_workers,
    require_packages,
    wait_for_workers,
)
from companion.campaign.design import few_samples_warning
from companion.campaign.folder import Description
from companion.campaign.loading import load
from companion.campaign.report.results import Results
from companion.campaign.unit import cases_per_unit, check_cases, unit_ranges
from companion.child_process import usable_cores
from companion.files.write_whole import file_and_reason
from companion.files.yaml_file import ConfigError
from companion.program_command import program_command

if TYPE_CHECKING:
    from distributed import Client

DONE, FAILED = 0, 1  # exit codes
_UNMEASURED_CASES_PER_WORKER = 2
"""With at most this number of cases for each worker, the wall time of a case is not measured."""
_MOST_SHOWN_LINES = 3
"""Largest number of lost units, of internal errors, and of reasons that are printed."""


def run(options: argparse.Namespace) -> int:
    """Run the campaign of a file, or continue the one in a folder; return the exit code.

    Raises:
        ConfigError: the file is wrong, the campaign is too large, or the folder cannot be used.
        MissingExtraError: the extra `campaign` is not installed.
    """
    require_packages()
    path: Path = options.file
    out: Path | None = options.out
    if path.is_dir():
        if out is not None:
            raise ConfigError(
                "a campaign's folder is continued in place, so --out cannot be given; leave it out"
            )
        path, out = path / folder.CAMPAIGN_FILE_NAME, path
    campaign = load(path)
    return _Run(campaign, out or folder.new_path(campaign), options).run()


class _Run:
    """One run of a campaign."""

    def __init__(
        self, campaign: Campaign, campaign_folder: Path, options: argparse.Namespace
    ) -> None:
        self._campaign, self._folder, self._options = campaign, campaign_folder, options
        self._console = Console(highlight=False, soft_wrap=True, markup=False)
        self._noun = CASE_NOUNS[campaign.file.kind]

    def run(self) -> int:
        """Run the campaign; return the exit code."""
        is_continued = folder.holds_campaign(self._folder)
        if is_continued:
            folder.resume(self._folder, self._campaign)
        seconds_per_case = None if is_continued else self._check_all_cases()
        try:
            with (
                interruptible(),
                cluster_client(self._options.scheduler, self._options.workers) as client,
            ):
                if not number_of_workers(client):
                    self._console.print("waiting for the cluster's first worker…")
                    wait_for_workers(client)
                workers = max(1, number_of_workers(client))  # the first may have left already
                with folder.lock(self._folder):
                    description = self._open_folder(seconds_per_case, workers)
                    self._console.print(f"Dask's dashboard: {client.dashboard_link}")
                    return self._run_with_progress(client, description)
        except KeyboardInterrupt:
            return self._report_stop("interrupted")
        except ClusterError as error:
            return self._report_stop(str(error))
        except OSError as error:  # such as a full disk
            return self._report_stop(file_and_reason(error))

    def _check_all_cases(self) -> float | None:
        """Check every case; return the wall time that a case takes, s; None: not measured."""
        campaign, kind = self._campaign, self._campaign.file.kind
        workers = self._options.workers or usable_cores()
        if campaign.number_of_cases > estimate.most_cases(campaign) and not self._options.yes:
            # The time of one case is enough to refuse; checking all cases would take long.
            first_case = [campaign.case(next(campaign.planned_cases()))]
            estimate.check_size(campaign, estimate.case_time(kind, first_case), workers)
        cases = list(campaign.cases())
        check_cases(kind, cases)
        if len(cases) <= _UNMEASURED_CASES_PER_WORKER * workers:
            return None
        seconds_per_case = estimate.case_time(kind, cases)
        if not self._options.yes:
            estimate.check_size(campaign, seconds_per_case, workers)
        return seconds_per_case

    def _open_folder(self, seconds_per_case: float | None, workers: int) -> Description:
        """Continue the campaign in its folder, or write the folder of a new one.

        `seconds_per_case` is the wall time that a case takes, s; None: it was not measured.
        """
        if folder.holds_campaign(self._folder):
            return folder.resume(self._folder, self._campaign)
        cases = self._campaign.number_of_cases
        unit_size = (
            1 if seconds_per_case is None else cases_per_unit(cases, seconds_per_case, workers)
        )
        description = folder.describe(self._campaign, unit_size, seconds_per_case)
        folder.make(self._folder, self._campaign, description)
        size_text = f"{cases} {self._noun}"
        if seconds_per_case is not None:
            size_text = estimate.size_text(
                self._campaign, cases * seconds_per_case / workers, workers
            )
        self._console.print(f"{size_text}; results in {self._folder}")
        if warning := few_samples_warning(self._campaign.file):
            self._console.print(warning)
        return description

    def _run_with_progress(self, client: "Client", description: Description) -> int:
        """Run the campaign with a progress bar; return the exit code."""
        with progress_bar(self._console, TextColumn("{task.description}")) as bar:
            task = bar.add_task(self._noun, total=description.cases)
            progress = engine.Progress()
            for progress in engine.run(client, self._campaign, description, self._folder):
                bar.update(task, completed=progress.flown_cases)
        return self._report_end(progress, description)

    def _report_end(self, progress: engine.Progress, description: Description) -> int:
        """Report how the run ended; return the exit code."""
        print_line = self._console.print
        for sentence in progress.given_up_units[:_MOST_SHOWN_LINES]:
            print_line(f"not flown: {sentence}")
        if progress.flown_cases < description.cases:
            count = len(progress.given_up_units)
            return self._report_stop(
                f"{count} unit{'s' if count > 1 else ''} of cases could not be flown"
            )
        errors = engine.internal_errors(self._folder, self._campaign.file)
        for error, count in errors.most_common(_MOST_SHOWN_LINES):
            print_line(f"{count} of the {self._noun} ended by an {error}")
        results = Results.read(self._folder)
        print_line(f"{results.good.sum()} of {progress.flown_cases} {self._noun} were good.")
        for reason, count in results.failures().most_common(_MOST_SHOWN_LINES):
            print_line(f"  {count} not good: {reason}")
        if results.as_documented.size:
            documented_count, faulty_count = results.as_documented.sum(), results.as_documented.size
            print_line(
                f"{documented_count} of {faulty_count} flights with a fault ended as documented."
            )
        print_line(f"The results are in {self._folder}. Write their report with")
        print_line(f"  {program_command('campaign', 'report', self._folder)}")
        return FAILED if errors else DONE

    def _report_stop(self, reason: str) -> int:
        """Print why the campaign stopped and how to continue; return the exit code."""
        if not folder.holds_campaign(self._folder):
            self._console.print(f"{reason}; no campaign was started")
            return FAILED
        description = folder.read_description(self._folder)
        units = unit_ranges(description.cases, description.unit)
        finished_cases = sum(len(units[number]) for number in store.finished_units(self._folder))
        scheduler = self._options.scheduler
        options = ["--scheduler", scheduler] if scheduler else []
        command = program_command("campaign", self._folder, *options)
        self._console.print(
            f"{reason}; the results of {finished_cases} of {description.cases} {self._noun} are "
            f"kept. Continue with\n  {command}"
        )
        return FAILED


def progress_bar(
    console: Console, first_column: ProgressColumn, *last_columns: ProgressColumn
) -> Progress:
    """A progress bar with numbers and times, between `first_column` and `last_columns`."""
    return Progress(
        first_column,
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        *last_columns,
        console=console,
    )


@contextmanager
def interruptible() -> Iterator[None]:
    """In the context, SIGTERM raises KeyboardInterrupt like Ctrl-C; further signals are ignored."""

    def interrupt(number: int, frame: FrameType | None) -> NoReturn:
        for signal_number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(signal_number, signal.SIG_IGN)
        raise KeyboardInterrupt

    previous_handlers = {
        signal_number: signal.signal(signal_number, interrupt)
        for signal_number in (signal.SIGINT, signal.SIGTERM)
    }
    try:
        yield
    finally:
        for signal_number, handler in previous_handlers.items():
            signal.signal(signal_number, handler)
