"""Runs studies with a progress bar, and writes their files and the page."""

from dataclasses import replace
from functools import partial
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any, NamedTuple

import matplotlib as mpl
from matplotlib.figure import Figure
from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    TaskID,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
)

from companion.files.yaml_file import ConfigError
from companion.study import registry
from companion.study.drawing import STYLE
from companion.study.outcome import Job, Outcome, Tick
from companion.study.registry import Study
from companion.study.report import write_outcome, write_page
from companion.study.workers import run_in_workers


class RunResults(NamedTuple):
    """The results of a run of one or all studies."""

    page: Path
    """Path of the page that shows all studies of the run."""
    rows: list[dict[str, Any]]
    """Rows of all studies, for `--json`."""


def run(
    name: str, case_file: Path | None, out: Path, console: Console, workers: int = 1
) -> RunResults:
    """Run one study of the registry, or `all`.

    Args:
        name: name of the study on the command line.
        case_file: file of `--case`, or None.
        out: folder for the results.
        console: console for the progress bar.
        workers: number of processes that run studies; the files do not depend on it.

    Raises:
        ConfigError: `out` or the case cannot be used, a case is missing, or the study takes none.
        OSError: a result cannot be written, a worker was killed, or the solver process of the
            study `nmpc` does not start (ChildProcessError).
    """
    jobs = {study.name: _make_job(study, case_file) for study in registry.selected_studies(name)}
    page = _prepare_folder(out, "study" if name == registry.ALL else name)
    workers = min(workers, len(jobs))
    with _progress(console) as progress:
        total_steps = sum(job.progress_steps for job in jobs.values()) + 1
        task = progress.add_task("", total=total_steps, study="")
        tick = partial(_tick, progress, task)
        if workers > 1:
            progress_steps = {key: job.progress_steps for key, job in jobs.items()}
            outcomes = run_in_workers(partial(_run_named, out), progress_steps, workers, tick)
        else:
            outcomes = {key: _run(job, out, partial(tick, key)) for key, job in jobs.items()}
        progress.update(task, description=page.name, study="")
        write_page(list(outcomes.values()), page)
        progress.update(task, completed=total_steps, description="done")
    return RunResults(page, [row for outcome in outcomes.values() for row in outcome.rows])


def _run_named(out: Path, name: str, tick: Tick) -> Outcome:
    """In a worker process, run a study that takes no case, and write its files.

    The returned outcome has an empty figure, because figures are too large to pass between
    processes. The written files have the complete figure.
    """
    outcome = _run(_make_job(registry.STUDIES[name], None), out, tick)
    return replace(outcome, figure=Figure())


def _run(job: Job, out: Path, tick: Tick) -> Outcome:
    """Run a study and write its files."""
    with mpl.rc_context():
        mpl.rcdefaults()  # the files must not depend on the user's matplotlibrc
        mpl.rcParams.update(STYLE)
        outcome = job.run(tick)
        write_outcome(outcome, out)
    return outcome


def _make_job(study: Study, case_file: Path | None) -> Job:
    """Import a study and make its job, with the case if the study takes one.

    Raises:
        ConfigError: the case is missing or cannot be used, or the study takes none.
    """
    if study.takes_case and case_file is None:
        raise ConfigError(f"study {study.name} needs a case: --case FILE")
    if case_file is not None and not study.takes_case:
        raise ConfigError(
            f"--case goes with study {registry.names_with_case()}; study {study.name} takes none"
        )
    module = import_module(study.module)
    if study.takes_case:
        job: Job = module.prepare(case_file)
        return job
    return Job(module.run, module.PROGRESS_STEPS)


def _prepare_folder(out: Path, name: str) -> Path:
    """Make the folder, and check that files can be written there; return the path of the page.

    Raises:
        ConfigError: nothing can be written there.
    """
    page = out / f"{name}.html"
    try:
        out.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=out):
            pass
    except OSError as error:
        raise ConfigError(f"--out: cannot write to {out}: {error.strerror}") from error
    if page.is_dir():
        raise ConfigError(f"--out: {page} is a folder, but the page needs that name")
    return page


def _progress(console: Console) -> Progress:
    return Progress(
        TextColumn("{task.fields[study]:<6}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.description}", markup=False),
        console=console,
    )


def _tick(progress: Progress, task: TaskID, study: str, step_name: str) -> None:
    progress.update(task, advance=1, description=step_name, study=study)
