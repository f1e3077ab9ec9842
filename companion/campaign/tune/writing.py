"""Writes the result of a search as YAML that a configuration can include, with reasons."""

from collections.abc import Iterator, Mapping
from math import isfinite
from typing import Any, NamedTuple

from companion.campaign.campaign import Campaign
from companion.campaign.swept import SweptValues
from companion.campaign.tune.candidates import Values
from companion.campaign.tune.certainty import Comparison
from companion.campaign.tune.scores import Candidate, Score, SearchResults
from companion.files import bounded_yaml

_RANGE_END_SHARE = 0.02
"""A value nearer to an end of its range than this share of the range counts as at the end."""


class CheckedResult(NamedTuple):
    """The result of a search, checked on unseen cases."""

    campaign: Campaign
    """The campaign, with its section `tune`."""
    results: SearchResults
    best: Candidate
    """The candidate that is proposed."""
    before: Score
    """Score of the configuration before the search, on the unseen cases."""
    after: Score
    """Score of `best`, on the unseen cases."""
    comparison: Comparison | None
    """`after` compared with `before`; None: too few samples were flown to their end."""


def summary_lines(result: CheckedResult) -> list[str]:
    """Text for the user: the search, its result, and how certain the result is."""
    results, best, tune = result.results, result.best, result.campaign.file.tune
    assert tune is not None
    cases = len(best.score.true_errors)
    constraint = (
        "reach their end" if tune.envelope_m is None else f"stay within {tune.envelope_m:g} m"
    )
    lines = [
        f"{results.tried_count} candidates over {cases} flights each,"
        f" {results.stopped_early_count} of them refused or stopped early; candidate"
        f" {best.number} is the best.",
        f"Constraint: at least {tune.inside_share:.1%} of the flights must {constraint}; in the "
        f"search {best.score.inside_share:.1%} did.",
        f"RMS of the true horizontal error in the search: {best.score.rms:.3f} m.",
    ]
    return [*lines, *_certainty_lines(result)]


def _certainty_lines(result: CheckedResult) -> Iterator[str]:
    unseen_flights = len(result.after.true_errors)
    early_counts = [
        sum(not isfinite(error) for error in score.true_errors)
        for score in (result.before, result.after)
    ]
    if any(early_counts):
        yield (
            f"Of {unseen_flights} flights that the search has not seen, {early_counts[0]} ended "
            f"early with the configuration before the search, and {early_counts[1]} with the "
            "result; a sample with a flight that ended early is not compared."
        )
    comparison = result.comparison
    if comparison is None:
        yield (
            "Fewer than two samples were flown to their end with both configurations, so no errors "
            "are compared."
        )
        return
    yield (
        f"On {comparison.samples} samples that the search has not seen, RMS of the true horizontal "
        f"error in m with its 95 % interval: {comparison.before} -> {comparison.after}."
    )
    yield (
        f"That is {comparison.ratio.value:.2f} times the error before, 95 % interval "
        f"{comparison.ratio.low:.2f} to {comparison.ratio.high:.2f}; better in "
        f"{comparison.better_samples} of {comparison.samples} samples."
    )
    before, after = comparison.estimated_errors
    estimate_before, estimate_after = comparison.estimator_errors
    yield (
        f"On the same flights the estimated position was {before:.3f} -> {after:.3f} m from the "
        f"reference, and {estimate_before:.3f} -> {estimate_after:.3f} m from the true position."
    )
    yield (
        "The distance from the true position is the estimate's own error. Gains and weights hardly "
        "change it; if the estimate is late, set guidance.position_lateness_ms."
    )
    if comparison.ratio.high >= 1.0:
        yield "The interval contains 1, so the result may not be better: fly more samples."


def result_text(result: CheckedResult, previous_values: Mapping[str, Any]) -> str:
    """The text of the result file.

    `previous_values` holds the values of the searched keys before the search, without keys that
    were not set.
    """
    tune = result.campaign.file.tune
    assert tune is not None
    name = result.campaign.file.name
    lines = [f"# Found by `companion campaign tune` for the campaign {name}.", "#"]
    lines += [f"# {line}" for line in summary_lines(result)]
    reasons = {
        key: _reason(key, tune.search[key], result, previous_values.get(key))
        for key in result.best.values
    }
    return "\n".join([*lines, *_values_lines(result.best.values, reasons)]) + "\n"


def best_so_far_text(best: Candidate) -> str:
    """The best candidate of a search that could not be finished, as YAML."""
    comment = (
        f"# The best candidate so far, not checked on unseen flights, RMS {best.score.rms:.3f} m:"
    )
    return "\n".join([comment, *_values_lines(best.values, {})]) + "\n"


def _values_lines(values: Values, reasons: Mapping[str, str]) -> Iterator[str]:
    """Values of dotted keys as lines of YAML, each after a comment with its reason, if any."""
    sections: dict[str, list[str]] = {}
    for key, value in values.items():
        section, _, name = key.partition(".")
        lines = sections.setdefault(section, [])
        if key in reasons:
            lines.append(f"  # {reasons[key]}")
        lines.append(f"  {name}: {bounded_yaml.dump_value(value)}")
    for section, lines in sections.items():
        yield from ("", f"{section}:", *lines)


def _reason(key: str, swept: SweptValues, result: CheckedResult, value_before: Any) -> str:
    """Text about a key: its value before the search (None: unset), and the best values found."""
    before_text = "was not set" if value_before is None else f"was {_value_text(value_before)}"
    near_values = [
        candidate.values[key] for candidate in result.results.near_best if key in candidate.values
    ]
    search_range = swept.uniform or swept.loguniform
    if search_range is None:
        same_count = sum(value == result.best.values[key] for value in near_values)
        return (
            f"{before_text}; {same_count} of the best {len(near_values)} candidates have this value"
        )
    low, high = search_range
    text = f"{before_text}; the best {len(near_values)} candidates have {min(near_values):.3g}"
    text += f" to {max(near_values):.3g}, searched from {low:g} to {high:g}"
    value = float(result.best.values[key])
    if min(value - low, high - value) < _RANGE_END_SHARE * (high - low):
        return f"{text}; this value lies at an end of the searched range: widen the range"
    is_wide = max(near_values) - min(near_values) > 0.5 * (high - low)
    return f"{text}; this key matters little here" if is_wide else text


def _value_text(value: Any) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)
