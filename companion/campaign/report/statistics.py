"""Success rates with their intervals, levels of a factor, worst cases, and the Pareto front."""

from itertools import pairwise
from math import inf, isfinite
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from companion.campaign.report.results import Column, Floats, Results

CONFIDENCE = 0.95
_MOST_LEVELS = 12
"""Largest number of different values of a factor that are each shown as a level."""
_RANGE_COUNT = 5
"""Number of ranges that divide a factor with more than `_MOST_LEVELS` different values."""
_MOST_GROUPS = 300
"""Largest number of groups of equal values; with more, `choice_groups` returns single cases."""
_NOT_CHOSEN_PREFIXES = ("mock.", "fault", "flight.", "vehicle.")
"""Prefixes of the factors that a user does not choose."""


class Share(NamedTuple):
    """The share of cases that have a property, with its Wilson interval.

    The interval covers the true share in 95 % of campaigns.
    """

    case_count: int
    """Number of cases that have the property."""
    total: int
    """Number of all cases."""
    share: float
    """`case_count` / `total`; NaN for no case."""
    low: float
    """Lower bound of the interval."""
    high: float
    """Upper bound of the interval."""

    def __str__(self) -> str:
        return f"{_percent(self.share)} % ({_percent(self.low)} to {_percent(self.high)} %)"


def _percent(share: float) -> str:
    percent = 100.0 * share
    if 99.0 <= percent < 100.0 or 0.0 < percent <= 1.0:
        return f"{percent:.2f}"
    return f"{percent:.1f}" if 0.0 < percent < 100.0 else f"{percent:.0f}"


def share_of(has_property: NDArray[np.bool_]) -> Share:
    """The share of cases for which the (cases,) array is True."""
    from scipy.stats import binomtest  # noqa: PLC0415  takes a second to import

    count, total = int(np.sum(has_property)), len(has_property)
    if not total:
        return Share(0, 0, np.nan, 0.0, 1.0)
    interval = binomtest(count, total).proportion_ci(CONFIDENCE, method="wilson")
    return Share(count, total, count / total, float(interval.low), float(interval.high))


class Group(NamedTuple):
    """Cases in which some factors have the same or similar values."""

    name: str
    """The common values of the factors, as text."""
    cases: NDArray[np.bool_]
    """(cases,), whether each case belongs to the group."""


def levels(column: Column) -> list[Group]:
    """The cases grouped by the levels of a factor, which are its values or ranges of them.

    With at most `_MOST_LEVELS` different values, each value is a level. Otherwise numbers are
    divided into `_RANGE_COUNT` ranges with about equally many cases, and null is a level of its
    own. Of texts, the first `_MOST_LEVELS` − 1 in alphabetical order are levels, and all others
    form the last level.
    """
    distinct_keys = sorted({_sort_key(value) for value in column})
    all_fit = len(distinct_keys) <= _MOST_LEVELS
    if column.dtype != float or all_fit:
        shown_keys = distinct_keys if all_fit else distinct_keys[: _MOST_LEVELS - 1]
        keys = [_sort_key(value) for value in column]
        groups = [
            Group(key[1], np.array([key == value_key for value_key in keys])) for key in shown_keys
        ]
        if not all_fit:
            others = np.array([key not in shown_keys for key in keys])
            groups.append(Group(f"{len(distinct_keys) - len(shown_keys)} others", others))
        return groups
    edges = np.nanquantile(column, np.linspace(0.0, 1.0, _RANGE_COUNT + 1))
    groups = []
    for number, (low, high) in enumerate(pairwise(edges)):
        is_last = number == _RANGE_COUNT - 1
        in_range = (column >= low) & ((column <= high) if is_last else (column < high))
        groups.append(Group(f"{low:.3g} to {high:.3g}", in_range))
    null_cases = np.isnan(column)
    if null_cases.any():
        groups.append(Group("null", null_cases))
    return groups


def _sort_key(value: object) -> tuple[float, str]:
    """A tuple that sorts values: the size (null first; 0 for a text), and the value as text."""
    if isinstance(value, bool):
        return float(value), str(value).lower()
    if isinstance(value, int | float) and isfinite(value):
        return float(value), f"{value:.4g}"
    if value is None or isinstance(value, float):  # a column of numbers has NaN for null
        return -inf, "null"
    return 0.0, str(value)


def worst_rows(results: Results, count: int) -> list[int]:
    """Row numbers of the `count` worst cases, the worst first.

    Crashed cases come first, then those that did not end as documented, then those that were not
    good; among equals, the larger error. An error that was not measured counts as infinite.
    """
    columns = results.columns
    error = columns[results.error_outcome]
    crashed = columns.get("crashed", np.zeros(results.count))
    as_documented = columns.get("as_documented", np.full(results.count, None))

    def rank(row: int) -> tuple[bool, bool, bool, float]:
        error_size = error[row] if np.isfinite(error[row]) else np.inf
        return (
            crashed[row] is not True,
            as_documented[row] is not False,
            bool(results.good[row]),
            -float(error_size),
        )

    return sorted(range(results.count), key=rank)[:count]


def pareto_front(objectives: Floats) -> NDArray[np.bool_]:
    """(n,): which of the (n, goals) points are Pareto-optimal; smaller is better in every goal."""
    is_optimal = np.ones(len(objectives), dtype=bool)
    for number, point in enumerate(objectives):
        at_least_as_good = np.all(objectives <= point, axis=1)
        better_in_one = np.any(objectives < point, axis=1)
        is_optimal[number] = not np.any(at_least_as_good & better_in_one)
    return is_optimal


def choice_groups(results: Results) -> list[Group]:
    """The cases grouped by equal values of the swept keys that a user chooses.

    The user chooses the keys outside `_NOT_CHOSEN_PREFIXES`. If no two cases have equal values, or
    there are more than `_MOST_GROUPS` groups, each group is a single case. Of many cases, only some
    at equal intervals are returned: fewer than 2·`_MOST_GROUPS`.
    """
    chosen_keys = [name for name in results.factors if not name.startswith(_NOT_CHOSEN_PREFIXES)]
    rows = range(results.count)
    keys = [tuple(_sort_key(results.columns[name][row]) for name in chosen_keys) for row in rows]
    distinct_keys = sorted(set(keys))
    if len(distinct_keys) > _MOST_GROUPS or len(distinct_keys) == len(keys):
        stride = max(1, len(keys) // _MOST_GROUPS)
        return [
            Group(f"case {results.columns['case'][row]}", np.arange(results.count) == row)
            for row in rows[::stride]
        ]
    return [
        Group(
            ", ".join(f"{name} = {text}" for name, (_, text) in zip(chosen_keys, key, strict=True))
            or "all cases",
            np.array([key == row_key for row_key in keys]),
        )
        for key in distinct_keys
    ]


def median(values: Floats) -> float:
    """The median of the finite values; NaN if there are none."""
    finite_values = values[np.isfinite(values)]
    return float(np.median(finite_values)) if len(finite_values) else np.nan
