"""What a study returns: its figure, its tables, and its findings on the paper's claims."""

import csv
import io
from collections.abc import Callable
from dataclasses import dataclass
from math import isinf
from typing import Any, Literal, NamedTuple

from matplotlib.figure import Figure
from tabulate import tabulate

Tick = Callable[[str], None]
"""A study calls this before each of its parts, with the name of that part."""

Cell = str | float | int

Source = Literal["paper", "ours"]
"""Of a finding: a claim of the paper, or our own statement about one of its claims."""


@dataclass(frozen=True)
class Table:
    """A table of results, written as CSV and Markdown and shown on the page.

    Attributes:
        name: of its files, without the ending.
        caption: one sentence.
        columns: titles, with units.
        rows: one cell for each column. CSV holds numbers in full; elsewhere they are rounded.
    """

    name: str
    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]

    def as_csv(self) -> str:
        """Comma-separated, numbers in full."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self.columns)
        writer.writerows(self.rows)
        return text.getvalue()

    def as_markdown(self) -> str:
        """A pipe table, numbers to three digits."""
        return f"{self.caption}\n\n{self._formatted('pipe')}\n"

    def as_html(self) -> str:
        """A table element, escaped, numbers to three digits."""
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
        source: where the statement is from.
        statement: one sentence that can be true or false.
        holds: whether the numbers support it.
        evidence: the numbers, and the bound they were compared with.
    """

    source: Source
    statement: str
    holds: bool
    evidence: str


@dataclass(frozen=True)
class Outcome:
    """The results of one study.

    Attributes:
        name: of its files.
        title: headline on the page.
        conditions: what was flown, in a sentence or two.
        figure: written as SVG and PNG.
        caption: what the figure shows.
        tables: the numbers, on the page and in files.
        findings: computed from the numbers of this run.
        series: further tables, written as CSV only.
        rows: what `--json` prints, if the study prints JSON.
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
        run: runs it; calls the tick before each part.
        parts: how many times it calls the tick.
    """

    run: Callable[[Tick], Outcome]
    parts: int
