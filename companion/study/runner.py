"""`companion study`: which studies there are, and running them with a progress bar."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any, NamedTuple

import matplotlib as mpl
from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    TaskID,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
)

from companion.files import yaml_file
from companion.files.yaml_file import ConfigError
from companion.study import custom, fig2, fig3, fig4, fig5, kmax, lag, rates, track
from companion.study.case import Case
from companion.study.drawing import STYLE
from companion.study.names import TRACK
from companion.study.outcome import Outcome, Tick
from companion.study.report import write_outcome, write_page


class _Study(NamedTuple):
    run: Callable[[Tick], Outcome]
    parts: int  # how many times it ticks


_STUDIES = {
    "fig2": _Study(fig2.run, fig2.PARTS),
    "fig3": _Study(fig3.run, fig3.PARTS),
    "fig4": _Study(fig4.run, fig4.PARTS),
    "fig5": _Study(fig5.run, fig5.PARTS),
    "rates": _Study(rates.run, rates.PARTS),
    "kmax": _Study(kmax.run, kmax.PARTS),
    "lag": _Study(lag.run, lag.PARTS),
}


class Studied(NamedTuple):
    """What was written, and what came of it.

    Attributes:
        page: everything, in one file.
        rows: those of all studies, for `--json`.
    """

    page: Path
    rows: list[dict[str, Any]]


def run(name: str, case_file: Path | None, out: Path, console: Console) -> Studied:
    """Run one study, `all` of them, or `custom` from a case file.

    Raises:
        ConfigError: `out` or the case cannot be used, or a case is missing or not asked for.
        OSError: a result cannot be written.
        VehicleStoppedError: the bundled vehicle ended before its flight did.
    """
    chosen = _chosen(name, case_file)
    page = _prepared(out, "study" if name == "all" else name)
    outcomes = []
    with mpl.rc_context(), _progress(console) as progress:
        mpl.rcdefaults()  # whatever matplotlibrc lies about, the same numbers give the same files
        mpl.rcParams.update(STYLE)
        total = sum(study.parts + 1 for study in chosen.values()) + 1
        task = progress.add_task("", total=total, study="")
        for key, study in chosen.items():
            outcome = study.run(partial(_tick, progress, task, key))
            write_outcome(outcome, out)
            progress.advance(task)
            outcomes.append(outcome)
        progress.update(task, description=page.name, study="")
        write_page(outcomes, page)
        progress.update(task, advance=1, description="done")
    return Studied(page, [row for outcome in outcomes for row in outcome.rows])


def _chosen(name: str, case_file: Path | None) -> dict[str, _Study]:
    if name == "custom":
        if case_file is None:
            raise ConfigError("study custom needs a case: --case FILE")
        case = yaml_file.load(case_file, Case)
        return {name: _Study(partial(custom.run, case), custom.parts(case))}
    if case_file is not None:
        raise ConfigError(f"--case goes with study custom; study {name} has its own case")
    if name == "nmpc":
        from companion.study import nmpc  # noqa: PLC0415  needs an extra of its own

        return {name: _Study(nmpc.run, nmpc.PARTS)}
    if name == TRACK:
        return {name: _Study(track.run, track.PARTS)}
    return _STUDIES if name == "all" else {name: _STUDIES[name]}


def _prepared(out: Path, name: str) -> Path:
    """Make the folder, and find out before the work whether it takes files."""
    page = out / f"{name}.html"
    try:
        out.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=out):
            pass
    except OSError as error:
        raise ConfigError(f"--out: cannot write to {out}: {error.strerror}") from error
    if page.is_dir():
        raise ConfigError(f"--out: {page} is a folder; the page is to have that name")
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


def _tick(progress: Progress, task: TaskID, study: str, part: str) -> None:
    progress.update(task, advance=1, description=part, study=study)
