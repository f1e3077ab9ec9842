"""The plots of a campaign's page."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from companion.campaign.report.results import RATE_OUTCOME, THRUST_OUTCOME, Floats, Results, label
from companion.campaign.report.sensitivity import Influence
from companion.campaign.report.statistics import (
    choice_groups,
    levels,
    median,
    pareto_front,
    share_of,
)
from companion.report.plots import (
    IDEAL_COLOUR,
    MEASURED_COLOUR,
    NEAREST_COLOUR,
    REFERENCE_COLOUR,
    Plot,
    axes,
    line,
    numbers,
)

_MOST_FACTORS = 6
"""Largest number of factors with a plot of their own."""
_DISTRIBUTIONS = (
    "position_rms_m",
    "height_rms_m",
    "model_deviation_max",
    "cross_axis_max",
    "time_constant_s",
    "rate_rms_rad_s",
    "saturated_share",
)
_SHOWN_QUANTILE = 0.995
"""Quantile at which the axis of a histogram ends; its last bin also holds all larger values."""
_BIN_COUNT = 40
"""Number of bins of a histogram."""


def success(results: Results, factor_order: Sequence[str]) -> Iterator[Plot]:
    """Success rate at each level of a factor; `factor_order`: the most influential first."""
    for name in factor_order[:_MOST_FACTORS]:
        factor_levels = levels(results.columns[name])
        shares = [share_of(results.good[level.cases]) for level in factor_levels]
        trace: dict[str, Any] = {
            "type": "scatter",
            "mode": "markers",
            "x": [level.name for level in factor_levels],
            "y": [_percent(share.share) for share in shares],
            "error_y": {
                "type": "data",
                "symmetric": False,
                "array": [_percent(share.high - share.share) for share in shares],
                "arrayminus": [_percent(share.share - share.low) for share in shares],
            },
            "marker": {"color": MEASURED_COLOUR, "size": 8},
            "text": [f"{share.case_count} of {share.total}" for share in shares],
            "hovertemplate": "%{x}: %{y:.1f} % (%{text})<extra></extra>",
        }
        layout = axes(x=label(name), y=f"good {results.noun}, %")
        layout["xaxis"]["type"] = "category"
        layout["yaxis"]["range"] = [-3.0, 103.0]
        note = "Share of good cases with its 95 % Wilson interval, over all other factors."
        yield Plot(f"Success by {name}", note, [trace], layout, 260)


def _percent(share: float) -> float | None:
    return round(100.0 * share, 3) if np.isfinite(share) else None


def sensitivity(influences: dict[str, list[Influence]]) -> Iterator[Plot]:
    """The first-order Sobol indices of each outcome as bars, a bar for each factor."""
    traces = []
    for (outcome, factor_influences), colour in zip(
        influences.items(), (MEASURED_COLOUR, NEAREST_COLOUR, REFERENCE_COLOUR), strict=False
    ):
        traces.append(
            {
                "type": "bar",
                "name": "good" if outcome == "ok" else label(outcome),
                "x": [influence.factor for influence in factor_influences],
                "y": numbers(
                    np.array([100.0 * influence.sobol_index for influence in factor_influences])
                ),
                "error_y": {
                    "type": "data",
                    "array": numbers(
                        np.array([100.0 * influence.confidence for influence in factor_influences])
                    ),
                },
                "marker": {"color": colour},
            }
        )
    layout = {**axes(y="share of the variance, %"), "barmode": "group"}
    note = (
        "First-order Sobol index: the share of an outcome's variance that a factor explains by "
        "itself, with its 95 % interval. The rest up to 100 % is noise, or the joint effect of "
        "several factors."
    )
    if traces:
        yield Plot("Sensitivity", note, traces, layout, 360)


def pareto(results: Results) -> Iterator[Plot]:
    """Error against commanded rate, coloured by thrust deviation; the Pareto front is marked."""
    columns = results.columns
    objective_names = [
        results.error_outcome,
        RATE_OUTCOME,
        *([THRUST_OUTCOME] if results.is_measured(THRUST_OUTCOME) else []),
    ]
    objective_rows, titles = [], []
    for choice in choice_groups(results):
        mask = choice.cases
        medians = np.array([median(columns[name][mask]) for name in objective_names])
        if np.isfinite(medians).all():
            objective_rows.append(medians)
            good_share = share_of(results.good[mask]).share
            titles.append(f"{choice.name}<br>good: {100.0 * good_share:.1f} %")
    if len(objective_rows) < 2:
        return
    objectives = np.array(objective_rows)
    on_front = pareto_front(objectives)
    has_thrust = len(objective_names) > 2
    traces = []
    for name, mask in (("on the front", on_front), ("others", ~on_front)):
        marker: dict[str, Any] = {"size": 11 if mask is on_front else 6}
        if mask is on_front:
            marker["line"] = {"color": REFERENCE_COLOUR, "width": 2}
        if has_thrust:
            marker |= _colour_scale(objectives[mask, 2], objectives[:, 2], shown=mask is on_front)
        else:
            marker["color"] = MEASURED_COLOUR if mask is on_front else IDEAL_COLOUR
        if mask.any():
            selected_titles = [titles[k] for k in np.flatnonzero(mask)]
            traces.append(
                line(
                    *(name, objectives[mask, 1], objectives[mask, 0], MEASURED_COLOUR),
                    mode="markers",
                    text=selected_titles,
                    hovertemplate="%{text}<br>%{y:.3g}, %{x:.3g}<extra></extra>",
                    marker=marker,
                )
            )
    criteria = "error, rate use and thrust use" if has_thrust else "error and rate use"
    note = (
        "Each point is one choice of the program's own keys: the medians over all other factors, "
        "and the success rate. If no choice was flown twice, or there are very many, each point is "
        f"one case. A point is on the front if no other point is better in {criteria} at once."
    )
    layout = axes(x=label(RATE_OUTCOME), y=label(results.error_outcome))
    yield Plot("Pareto front", note, traces, layout, 420)


def _colour_scale(values: Floats, all_values: Floats, *, shown: bool) -> dict[str, Any]:
    """Colours of points by their thrust deviations `values`, on a scale over `all_values`.

    `shown`: whether the colour bar is shown.
    """
    return {
        "color": numbers(values),
        "cmin": float(all_values.min()),
        "cmax": float(all_values.max()),
        "colorscale": "Viridis",
        "showscale": shown,
        "colorbar": {"title": {"text": "thrust use", "side": "right"}, "thickness": 12},
    }


def distributions(results: Results) -> Iterator[Plot]:
    """Histograms of the outcomes: good cases, and others."""
    for name in _DISTRIBUTIONS:
        if not results.is_measured(name):
            continue
        values = results.columns[name]
        is_finite = np.isfinite(values)
        low = float(values[is_finite].min())
        high = float(np.quantile(values[is_finite], _SHOWN_QUANTILE))
        if high <= low:
            continue
        edges = np.linspace(low, high, _BIN_COUNT + 1)
        traces = []
        for is_good, title, colour in (
            (True, "good", MEASURED_COLOUR),
            (False, "not good", REFERENCE_COLOUR),
        ):
            selected_values = values[is_finite & (results.good == is_good)]
            counts, _ = np.histogram(np.clip(selected_values, low, high), edges)
            traces.append(
                {
                    "type": "bar",
                    "name": title,
                    "x": numbers(0.5 * (edges[:-1] + edges[1:])),
                    "y": counts.tolist(),
                    "width": float(edges[1] - edges[0]),
                    "marker": {"color": colour},
                }
            )
        layout = {**axes(x=label(name), y=results.noun), "barmode": "stack", "bargap": 0.0}
        p05, median, p95 = np.quantile(values[is_finite], (0.05, 0.5, 0.95))
        note = (
            f"Median {median:.3g}; nine of ten lie from {p05:.3g} to {p95:.3g}. The last bar "
            "holds all larger values."
        )
        yield Plot(f"Distribution: {label(name)}", note, traces, layout, 260)
