"""The outcome of a study: figure, tables, and findings on the paper's claims and our own."""

import csv
import io
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import isinf
from typing import Any, Literal, NamedTuple

from matplotlib.figure import Figure
from tabulate import tabulate

Tick = Callable[[str], None]
"""Progress callback: a study calls it before each of its steps, with the name of the step."""

Cell = str | float | int
Row = Mapping[str, Cell]
"""Cell by title of the column, with its unit."""

Claimant = Literal["paper", "ours"]
"""Who claims a statement: the paper, or this project."""


@dataclass(frozen=True)
class Table:
    """A table of results, written as CSV and Markdown and shown on the page."""

    name: str
    """Name of the table's files, without extension."""
    caption: str
    """Caption, one sentence."""
    rows: tuple[Row, ...]
    """Rows, with the same columns in the same order."""

    def as_csv(self) -> str:
        """The table as comma-separated values, with all digits of numbers."""
        text = io.StringIO()
        writer = csv.DictWriter(text, self.rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(self.rows)
        return text.getvalue()

    def as_markdown(self) -> str:
        """Caption and table in Markdown, with numbers rounded to three digits."""
        return f"{self.caption}\n\n{self._formatted('pipe')}\n"

    def as_html(self) -> str:
        """The table as an escaped HTML element, with numbers rounded to three digits."""
        return self._formatted("html")

    def _formatted(self, table_format: str) -> str:
        first_row = self.rows[0]
        return tabulate(
            [[_rounded(cell) for cell in row.values()] for row in self.rows],
            list(first_row),
            tablefmt=table_format,
            disable_numparse=True,
            colalign=["left" if isinstance(cell, str) else "right" for cell in first_row.values()],
        )


def _rounded(cell: Cell) -> str:
    if not isinstance(cell, float):
        return str(cell)
    if isinf(cell):
        return "never"
    return f"{cell:.0f}" if abs(cell) >= 1e3 else f"{cell:.3g}"


@dataclass(frozen=True)
class Finding:
    """A statement, and whether the computed numbers support it."""

    claimant: Claimant
    """Who claims the statement."""
    statement: str
    """One sentence that can be true or false."""
    holds: bool
    """Whether the numbers support the statement."""
    evidence: str
    """The numbers, and the bound with which they were compared."""


@dataclass(frozen=True)
class Outcome:
    """The results of one study."""

    name: str
    """Name of the figure's files, without extension."""
    title: str
    """Title on the page."""
    conditions: str
    """What was flown, in a few sentences."""
    figure: Figure
    """The figure, written as SVG and PNG."""
    caption: str
    """Description of the figure."""
    tables: tuple[Table, ...]
    """Tables on the page and in files."""
    findings: tuple[Finding, ...] = ()
    """Findings computed from the numbers of this run."""
    series: tuple[Table, ...] = ()
    """Further tables, written as CSV only."""
    rows: tuple[dict[str, Any], ...] = ()
    """Rows that `--json` prints, if the study supports it."""


class Job(NamedTuple):
    """A study that is ready to run."""

    run: Callable[[Tick], Outcome]
    """Runs the study; calls its `Tick` before each step."""
    progress_steps: int
    """Number of calls of the `Tick`."""
