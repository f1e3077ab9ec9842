"""The outcome of a study: figure, tables, and findings on the paper's claims and our own."""

import csv
import io
from collections.abc import Callable
from dataclasses import dataclass
from math import isinf
from typing import Any, Literal, NamedTuple

from matplotlib.figure import Figure
from tabulate import tabulate

Tick = Callable[[str], None]
"""Progress callback: a study calls it before each of its parts, with the name of the part."""

Cell = str | float | int

Claimant = Literal["paper", "ours"]
"""Who claims a statement: the paper, or this project."""


@dataclass(frozen=True)
class Table:
    """A table of results, written as CSV and Markdown and shown on the page.

    Attributes:
        name: name of its files, without the ending.
        caption: one sentence.
        columns: titles with units.
        rows: one cell for each column.
    """

    name: str
    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]

    def as_csv(self) -> str:
        """The table as comma-separated values, with all digits of numbers."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self.columns)
        writer.writerows(self.rows)
        return text.getvalue()

    def as_markdown(self) -> str:
        """Caption and table in Markdown, with numbers rounded to three digits."""
        return f"{self.caption}\n\n{self._formatted('pipe')}\n"

    def as_html(self) -> str:
        """The table as an escaped HTML element, with numbers rounded to three digits."""
        return self._formatted("html")

    def _formatted(self, table_format: str) -> str:
        numeric = [not isinstance(cell, str) for cell in self.rows[0]]
        return tabulate(
            [[_rounded(cell) for cell in row] for row in self.rows],
            self.columns,
            tablefmt=table_format,
            disable_numparse=True,
            colalign=["right" if number else "left" for number in numeric],
        )


def _rounded(cell: Cell) -> str:
    if not isinstance(cell, float):
        return str(cell)
    if isinf(cell):
        return "never"
    return f"{cell:.0f}" if abs(cell) >= 1e3 else f"{cell:.3g}"


@dataclass(frozen=True)
class Finding:
    """A statement, and whether the computed numbers support it.

    Attributes:
        claimant: who claims the statement.
        statement: one sentence that can be true or false.
        holds: whether the numbers support it.
        evidence: the numbers, and the bound with which they were compared.
    """

    claimant: Claimant
    statement: str
    holds: bool
    evidence: str


@dataclass(frozen=True)
class Outcome:
    """The results of one study.

    Attributes:
        name: name of its files, without the ending.
        title: title on the page.
        conditions: what was flown, in a few sentences.
        figure: the figure, written as SVG and PNG.
        caption: description of the figure.
        tables: tables on the page and in files.
        findings: findings computed from the numbers of this run.
        series: further tables, written as CSV only.
        rows: rows that `--json` prints, if the study supports it.
    """

    name: str
    title: str
    conditions: str
    figure: Figure
    caption: str
    tables: tuple[Table, ...]
    findings: tuple[Finding, ...] = ()
    series: tuple[Table, ...] = ()
    rows: tuple[dict[str, Any], ...] = ()


class Job(NamedTuple):
    """A study that is ready to run.

    Attributes:
        run: runs the study; calls its `Tick` before each part.
        parts: number of parts.
    """

    run: Callable[[Tick], Outcome]
    parts: int
