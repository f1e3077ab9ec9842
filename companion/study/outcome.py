"""What a study hands over: its figure, its tables, and what it found of the paper's claims."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from matplotlib.figure import Figure

from companion.study.table import Table

Tick = Callable[[str], None]
"""Called before each part of a study, with what comes now."""


@dataclass(frozen=True)
class Finding:
    """A statement, whether the computed numbers bear it out, and those numbers.

    Attributes:
        source: "paper" where the paper claims it, "asked" where its claim raises the question.
        statement: what is claimed or asked.
        holds: the verdict.
        evidence: the numbers, and the bound they were held against.
    """

    source: Literal["paper", "asked"]
    statement: str
    holds: bool
    evidence: str


@dataclass(frozen=True)
class Outcome:
    """One study, done.

    Attributes:
        name: of its files.
        title: headline on the page.
        conditions: what was flown, in a sentence or two.
        figure: to be written as SVG and PNG.
        caption: what the figure shows.
        tables: the numbers.
        findings: each made from the numbers, none from memory.
        series: further tables, written as CSV only.
        rows: what `--json` prints, where the study has it.
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
