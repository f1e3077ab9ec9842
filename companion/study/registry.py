"""The table of studies. To add a study, write its module and add its entry to `STUDIES`.

The command line, its help, `study all`, the page and the tests are derived from the table. This
module imports no study, so the command line needs none of the extras.
"""

from typing import NamedTuple

from companion.extras import require

ALL = "all"
"""Name on the command line that selects all studies with `in_all`."""

_PACKAGES = {"study": ("jinja2", "matplotlib", "tabulate"), "nmpc": ("casadi",)}
"""The packages of each extra that a study needs; numba only speeds up large batches."""


class Study(NamedTuple):
    """An entry of the table of studies."""

    name: str
    """Name on the command line; the names of the study's files begin with it."""
    summary: str
    """One line for `companion study --help`."""
    module: str
    """Module that is imported when the study runs. The module has `run(tick) -> Outcome`, and
    `PROGRESS_STEPS`, the number of times that `run` calls its tick; with `takes_case`, it has
    `prepare(case) -> Job` instead."""
    extra: str = ""
    """Extra of the package that the study needs besides `study`; empty: none."""
    in_all: bool = True
    """Whether `all` includes the study. False if the study takes minutes, times the computer, or
    needs a case."""
    takes_case: bool = False
    """Whether the study reads a case from `--case FILE`."""
    prints_json: bool = False
    """Whether the study's outcome has rows for `--json`."""


_ENTRIES = (
    Study("fig2", "step response without limits, every method", "companion.study.paper.fig2"),
    Study("fig3", "Euler angles at every heading", "companion.study.paper.fig3"),
    Study("fig4", "step response with the tilt rate limited", "companion.study.paper.fig4"),
    Study("fig5", "step response with the complete inner loop", "companion.study.paper.fig5"),
    Study("rates", "error of the paper's method by sample rate", "companion.study.paper.rates"),
    Study(
        "kmax",
        "body rate needed per rate of the acceleration coefficients",
        "companion.study.paper.kmax",
    ),
    Study(
        "lag",
        "every planner behind dead time and lag of the rate loop",
        "companion.study.lag.study",
    ),
    Study(
        "nmpc",
        "solve time and tracking error of the prediction models; times this machine",
        "companion.study.nmpc.study",
        extra="nmpc",
        in_all=False,
    ),
    Study(
        "track",
        "tracking error of every planner on the bundled vehicle; takes minutes",
        "companion.study.track.study",
        extra="nmpc",
        in_all=False,
        prints_json=True,
    ),
    Study(
        "custom",
        "a step of your own, from --case FILE",
        "companion.study.custom",
        in_all=False,
        takes_case=True,
    ),
)

STUDIES = {study.name: study for study in _ENTRIES}


def selected_studies(name: str) -> tuple[Study, ...]:
    """The studies that a name on the command line selects."""
    if name == ALL:
        return tuple(study for study in STUDIES.values() if study.in_all)
    return (STUDIES[name],)


def study_names() -> tuple[str, ...]:
    """All names that the command line accepts."""
    return (*STUDIES, ALL)


def help_table() -> str:
    """Help text with one line for each name that the command line accepts."""
    all_names = ", ".join(study.name for study in selected_studies(ALL))
    lines = [(study.name, study.summary) for study in STUDIES.values()]
    return "\n".join(f"  {name:<8}{text}" for name, text in [*lines, (ALL, all_names)])


def names_with_json() -> str:
    """The studies that accept `--json`, comma-separated."""
    return ", ".join(study.name for study in STUDIES.values() if study.prints_json)


def names_with_case() -> str:
    """The studies that accept `--case`, comma-separated."""
    return ", ".join(study.name for study in STUDIES.values() if study.takes_case)


def check_extras(name: str) -> None:
    """Make sure that the extras of the chosen studies are installed.

    Raises:
        MissingExtraError: a package is missing; the message says how to install it.
    """
    for package in _PACKAGES["study"]:
        require(package, "study", "`companion study`")
    for study in selected_studies(name):
        for package in _PACKAGES.get(study.extra, ()):
            require(package, study.extra, f"`companion study {study.name}`")
