"""The tables of a campaign's page."""

import json
from collections.abc import Iterator, Sequence
from math import isfinite

import numpy as np

from companion.campaign.campaign import Campaign
from companion.campaign.outcomes import OUTCOME_LABELS
from companion.campaign.report.results import RATE_OUTCOME, Floats, Results, label
from companion.campaign.report.sensitivity import Influence
from companion.campaign.report.statistics import levels, median, share_of, worst_rows
from companion.config.reference import keys
from companion.config.units import unit_of
from companion.flight.flown_config import flattened
from companion.program_command import program_command
from companion.report.plots import even_indices
from companion.report.tables import Table
from companion.testing.settings import mock_with_defaults

EMPTY = "–"
_MOST_WORST_CASES = 10  # cases in the table of worst cases
_MOST_ROWS = 200  # of the table of all cases
_MOST_FACTORS = 12  # in the table of success by factor
_MOST_LEVELS = 12
"""Largest number of values of a factor in the table of two factors."""


def worst_cases(results: Results) -> Table:
    """The worst cases, each with the command that flies it again with full recording."""
    columns = results.columns
    text_columns = [name for name in ("result", "failed_checks") if name in columns]
    rows = [
        (
            str(columns["case"][row]),
            _rerun_command(results, int(columns["case"][row])),
            *(_cell(columns[name][row]) for name in (results.error_outcome, *text_columns)),
            ", ".join(f"{name} = {_cell(columns[name][row])}" for name in results.factors),
        )
        for row in worst_rows(results, _MOST_WORST_CASES)
    ]
    header = (
        "case",
        "fly it again, recorded",
        label(results.error_outcome),
        *text_columns,
        "factors",
    )
    return Table("Worst cases", tuple(title.replace("_", " ") for title in header), rows)


def _rerun_command(results: Results, case: int) -> str:
    if results.kind == "batch":
        return EMPTY
    return program_command("campaign", "rerun", results.folder, str(case))


def configuration(campaign: Campaign) -> Table:
    """The configuration of every case: limits, and keys that differ from the default.

    Swept keys are left out.
    """
    swept_keys = campaign.file.swept_keys
    rows = [
        (f"{key.section}.{key.name}", json.dumps(key.value), json.dumps(key.default), key.unit)
        for key in keys(campaign.base)
        if key.section == "limits" or key.value != key.default
    ]
    mock = campaign.base.mock or {}
    defaults = flattened(mock_with_defaults({"autopilot": mock["autopilot"]}))
    rows += [
        (f"mock.{key}", value, defaults.get(key, EMPTY), unit_of(key))
        for key, value in flattened(mock).items()
        if value != defaults.get(key)
    ]
    title = "Configuration of every case: the limits, and the keys that differ from the default"
    header = ("key", "value", "default", "unit")
    return Table(title, header, [row for row in rows if row[0] not in swept_keys])


def success_by_factor(results: Results, factor_order: Sequence[str]) -> Table:
    """Success rate, median error and median body rate by level of the most influential factors."""
    rows = [row for name in factor_order[:_MOST_FACTORS] for row in _level_rows(results, name)]
    return Table("Success by factor", tuple(rows[0]), [tuple(row.values()) for row in rows])


def _level_rows(results: Results, name: str) -> Iterator[dict[str, str]]:
    """A row for each level of a factor: cell by title of the column."""
    columns = results.columns
    for level in levels(columns[name]):
        row = {"factor": name, "value": level.name, results.noun: str(int(level.cases.sum()))}
        row["good (95 % interval)"] = str(share_of(results.good[level.cases]))
        if "as_documented" in columns and "fault" in results.factors:
            endings = [end for end in columns["as_documented"][level.cases] if end is not None]
            share = str(share_of(np.array(endings, dtype=bool))) if endings else EMPTY
            row["ended as documented (95 % interval)"] = share
        for outcome in (results.error_outcome, RATE_OUTCOME):
            row[f"median {label(outcome)}"] = _median_text(columns[outcome][level.cases])
        yield row


def _median_text(values: Floats) -> str:
    median_value = median(values)
    return f"{median_value:.3g}" if isfinite(median_value) else EMPTY


def sensitivity(influences: dict[str, list[Influence]]) -> Table:
    """The first-order Sobol indices of each outcome, with their intervals."""
    factors = dict.fromkeys(
        influence.factor
        for factor_influences in influences.values()
        for influence in factor_influences
    )
    index_texts = {
        outcome: {
            influence.factor: f"{influence.sobol_index:.0%} ± {influence.confidence:.0%}"
            for influence in factor_influences
        }
        for outcome, factor_influences in influences.items()
    }
    rows = [
        (factor, *(index_texts[outcome].get(factor, EMPTY) for outcome in influences))
        for factor in factors
    ]
    header = ("factor", *("good" if name == "ok" else OUTCOME_LABELS[name] for name in influences))
    return Table("Share of the variance that a factor explains by itself", header, rows)


def two_factors(results: Results) -> Table | None:
    """Median error and success rate for each pair of values of two factors.

    The table shows the first two factors with 2 to `_MOST_LEVELS` values. None: there are fewer
    than two of these factors.
    """
    columns = results.columns
    factors_with_few_values = [
        name
        for name in results.factors
        if 1 < len({str(value) for value in columns[name]}) <= _MOST_LEVELS
    ]
    if len(factors_with_few_values) < 2:
        return None
    first_factor, second_factor = factors_with_few_values[0], factors_with_few_values[1]
    second_levels = levels(columns[second_factor])
    rows = []
    for level in levels(columns[first_factor]):
        cells = []
        for second_level in second_levels:
            in_both_levels = level.cases & second_level.cases
            good_share = share_of(results.good[in_both_levels]).share
            median_error = _median_text(columns[results.error_outcome][in_both_levels])
            cells.append(f"{median_error} ({good_share:.0%})")
        rows.append((level.name, *cells))
    error = label(results.error_outcome)
    title = f"Median {error} and share of good {results.noun}: {first_factor} × {second_factor}"
    return Table(title, (first_factor, *(level.name for level in second_levels)), rows)


def all_cases(results: Results) -> Table:
    """All cases; if there are more than `_MOST_ROWS`, evenly spaced cases."""
    shown_columns = [name for name in results.columns if name not in ("seed", "digest")]
    count = results.count
    shown_rows = even_indices(count, _MOST_ROWS)
    rows = [
        tuple(_cell(results.columns[name][row]) for name in shown_columns) for row in shown_rows
    ]
    count_note = "" if len(shown_rows) == count else f", {len(shown_rows)} of {count}"
    return Table(
        f"Cases{count_note} (all of them are in results.csv and results.parquet)",
        tuple(shown_columns),
        rows,
    )


def _cell(value: object) -> str:
    if value is None or value == "":
        return EMPTY
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}" if np.isfinite(value) else EMPTY
    return str(value)
