"""Which factor an outcome depends on, estimated from the flown cases with SALib.

The first-order Sobol index of a factor is the share of the outcome's variance that would vanish on
average if the factor were known. The index is estimated from given samples: the cases are divided
into bins by the value of the factor, and the variance between the bins is compared with the
variance of all cases. The joint effect of two factors is in no first-order index.
"""

from typing import NamedTuple

import numpy as np

from companion.campaign.report.results import Column, Floats, Results
from companion.report.plots import even_indices

FEWEST_CASES = 100
"""Smallest number of cases for useful indices."""
_MOST_CASES = 5000
"""Largest number of cases used; if there are more, this number of evenly spaced cases is used."""
_SEED = 1


class Influence(NamedTuple):
    """The first-order Sobol index of a factor on an outcome."""

    factor: str
    sobol_index: float
    """The first-order Sobol index, 0..1."""
    confidence: float
    """Half width of the index's 95 % interval, by bootstrap; NaN where bootstrap finds none."""


def influences(results: Results, outcome: str) -> list[Influence]:
    """The influence of each factor on an outcome (a column of numbers, or `ok`), the largest first.

    Factors with a single value are left out. The list is empty if no factor is left, if fewer than
    `FEWEST_CASES` cases were measured, or if the outcome is always the same.
    """
    values = np.array(results.columns[outcome], dtype=float)
    rows = np.flatnonzero(np.isfinite(values))
    rows = rows[even_indices(len(rows), _MOST_CASES)]
    values = values[rows]
    columns = {name: _as_numbers(results.columns[name][rows], values) for name in results.factors}
    columns = {name: column for name, column in columns.items() if np.ptp(column) > 0.0}
    if len(rows) < FEWEST_CASES or not columns or not np.ptp(values) > 1e-12:
        return []
    from SALib.analyze import delta  # noqa: PLC0415  takes a second to import

    problem = {
        "num_vars": len(columns),
        "names": list(columns),
        "bounds": [[0.0, 1.0]] * len(columns),
    }
    indices = delta.analyze(
        problem, np.column_stack(list(columns.values())), values, seed=_SEED, method="sobol"
    )
    named_indices = zip(columns, indices["S1"], indices["S1_conf"], strict=True)
    return sorted(
        (
            Influence(name, float(index), float(half_width))
            for name, index, half_width in named_indices
        ),
        key=lambda influence: -influence.sobol_index,
    )


def _as_numbers(column: Column, values: Floats) -> Floats:
    """A factor (cases,) as numbers, for an outcome (cases,).

    Texts and booleans are numbered in the order of their mean outcome. In another order, texts with
    different outcomes could share a bin, and their difference would be lost. A null among numbers
    becomes a number below all others.
    """
    if column.dtype == float:
        return np.where(np.isfinite(column), column, np.nanmin(column, initial=0.0) - 1.0)
    value_texts = np.array([str(value) for value in column])
    ordered_texts = sorted(
        set(value_texts), key=lambda text: float(values[value_texts == text].mean())
    )
    return np.array([float(ordered_texts.index(text)) for text in value_texts])
