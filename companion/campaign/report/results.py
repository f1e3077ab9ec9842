"""The results of a campaign so far, as NumPy columns."""

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from companion.campaign import store
from companion.campaign.campaign_file import CASE_NOUNS
from companion.campaign.folder import read_description
from companion.campaign.outcomes import OUTCOME_LABELS
from companion.config.units import unit_of

if TYPE_CHECKING:
    import pyarrow as pa

Floats = NDArray[np.float64]
Column = NDArray[Any]

_NUMBER = re.compile(r"\d+(\.\d+)?")

TRUE_ERROR = "position_rms_m"
ERROR_OUTCOMES = (TRUE_ERROR, "model_deviation_max")
"""Outcomes that may serve as the campaign's error; the first one that was measured is used."""
RATE_OUTCOME, THRUST_OUTCOME = "rate_rms_rad_s", "thrust_rms"


def label(name: str) -> str:
    """Text and unit for an outcome or a factor on the page."""
    text = OUTCOME_LABELS.get(name, name)
    return f"{text}, {unit_of(name)}" if unit_of(name) else text


@dataclass(frozen=True)
class Results:
    """The cases of a campaign that have been flown."""

    folder: Path
    name: str
    kind: str
    """flights or batch."""
    planned_count: int
    """Number of cases of the whole campaign, flown or not."""
    factors: Mapping[str, Any]
    """Metadata of each factor, by name: `SweptValues.description`, and its unit."""
    table: "pa.Table"
    """All rows, as returned by `store.read`."""

    @classmethod
    def read(cls, folder: Path) -> "Results":
        """Read the results in a folder.

        Raises:
            ConfigError: the folder holds no campaign or no results yet, or a file is damaged.
        """
        planned_count = read_description(folder).cases
        table = store.read(folder)
        metadata = store.metadata(table)
        return cls(
            folder, metadata["name"], metadata["kind"], planned_count, metadata["factors"], table
        )

    @cached_property
    def columns(self) -> dict[str, Column]:
        """Every column, (cases,), by name: numbers as float64, NaN for null; others as objects."""
        arrays = {}
        for field in self.table.schema:
            column = self.table.column(field.name)
            if str(field.type) == "double":
                arrays[field.name] = column.to_numpy()  # null becomes NaN
            else:
                arrays[field.name] = np.array(column.to_pylist(), dtype=object)
        return arrays

    @property
    def count(self) -> int:
        """Number of cases flown so far."""
        return int(self.table.num_rows)

    @cached_property
    def good(self) -> NDArray[np.bool_]:
        """(cases,): whether each case was good."""
        return np.array(self.columns["ok"], dtype=bool)

    def failures(self) -> Counter[str]:
        """How many cases were not good, by reason; the numbers in a reason are replaced by `…`."""
        reasons = (self.reason(row) for row in range(self.count) if not self.good[row])
        return Counter(_NUMBER.sub("…", reason) for reason in reasons)

    def reason(self, row: int) -> str:
        """Why the case in a row was not good."""
        result = str(self.columns["result"][row])
        if result != "ok":
            return result
        return str(self.columns["failed_checks"][row] or "") or "crashed"

    @cached_property
    def as_documented(self) -> NDArray[np.bool_]:
        """(k,): for each of the k cases with a fault, whether it ended as documented for it."""
        endings = self.columns.get("as_documented", ())
        return np.array([value for value in endings if value is not None], dtype=bool)

    @property
    def all_faulty(self) -> bool:
        """Whether every case has a fault; success then means an ending as documented."""
        return self.as_documented.size == self.count > 0

    @property
    def noun(self) -> str:
        """Plural noun for the cases, such as `flights`."""
        return CASE_NOUNS[self.kind]

    @property
    def error_outcome(self) -> str:
        """Name of the outcome that serves as the campaign's error; see `ERROR_OUTCOMES`."""
        return next((name for name in ERROR_OUTCOMES if self.is_measured(name)), ERROR_OUTCOMES[-1])

    def is_measured(self, name: str) -> bool:
        """Whether there is a column of numbers with this name, with at least one finite value."""
        column = self.columns.get(name)
        return column is not None and column.dtype == float and bool(np.isfinite(column).any())

    @property
    def crashed_count(self) -> int:
        """Number of cases that crashed."""
        return sum(value is True for value in self.columns.get("crashed", ()))
