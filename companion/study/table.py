"""A table of results, for spreadsheets (CSV), for papers and issues (Markdown), for the page."""

import csv
import io
from dataclasses import dataclass
from math import isinf

from tabulate import tabulate

Cell = str | float | int


@dataclass(frozen=True)
class Table:
    """Rows under named columns, units in the names.

    Attributes:
        name: of the files, without ending.
        caption: one sentence.
        columns: titles.
        rows: as many cells each; numbers in full, they are rounded where they are shown.
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
        return f"{self.caption}\n\n{self._shown('pipe')}\n"

    def as_html(self) -> str:
        """A table element, escaped, numbers to three digits."""
        return self._shown("html")

    def _shown(self, form: str) -> str:
        numeric = [not isinstance(cell, str) for cell in self.rows[0]]
        return tabulate(
            [[_rounded(cell) for cell in row] for row in self.rows],
            self.columns,
            tablefmt=form,
            disable_numparse=True,
            colalign=["right" if number else "left" for number in numeric],
        )


def _rounded(cell: Cell) -> str:
    if not isinstance(cell, float):
        return str(cell)
    if isinf(cell):
        return "never"
    return f"{cell:.0f}" if abs(cell) >= 1e3 else f"{cell:.3g}"
