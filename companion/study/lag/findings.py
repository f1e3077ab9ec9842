"""The findings of the study `lag`: statements, and whether the flights support them."""

from companion.study.lag.flights import (
    MAX_TILT_RATE,
    SHOWN_RATE_HZ,
    CompleteLoopFlights,
    DelayMismatch,
    Example,
    Grid,
    score,
)
from companion.study.measures import largest_tilt_rate
from companion.study.methods import (
    LAW_METHODS,
    MODEL_FOLLOWING_METHOD,
    PROPOSED,
    QUATERNION,
    Method,
)
from companion.study.outcome import Finding

_ROUNDING = 1e-9


def make_findings(
    grid: Grid, example: Example, complete: CompleteLoopFlights, fit_deviations: dict[Method, float]
) -> tuple[Finding, ...]:
    """All findings, those on the example first.

    Args:
        grid: flights over dead times, lags and sample rates.
        example: flights with `EXAMPLE_LOOP`.
        complete: flights with the complete inner loop.
        fit_deviations: largest deviation of each method from the second-order model fitted to it.
    """
    return (
        *_example_findings(example),
        _grid_finding(grid),
        _wrong_delays_finding(grid),
        _long_or_short_delays_finding(grid, complete),
        *_complete_loop_findings(complete, fit_deviations),
    )


def _example_findings(example: Example) -> tuple[Finding, Finding, Finding]:
    cross_tracks = {m: score(r).cross_track for m, r in example.unlimited_responses[100.0].items()}
    best_law_method = min(LAW_METHODS, key=lambda method: cross_tracks[method])
    worst_cross_track = max(
        wrong_score.cross_track for wrong_score in example.model_following_scores.values()
    )
    largest_rate = max(
        largest_tilt_rate(response) for response in example.rate_limited_responses.values()
    )
    limited_cross_track = max(
        score(response).cross_track for response in example.rate_limited_responses.values()
    )
    return (
        Finding(
            "ours",
            "Behind dead time and lag the proposed method keeps closest to the straight line.",
            cross_tracks[PROPOSED] <= cross_tracks[best_law_method],
            f"Cross-track at 100 Hz: first-order {cross_tracks[PROPOSED]:.2g},"
            f" {best_law_method.label}"
            f" {cross_tracks[best_law_method]:.2g}.",
        ),
        Finding(
            "ours",
            "Behind dead time and lag model-following is the straightest, even with an"
            " assumed lag and dead time wrong by up to 50 %.",
            worst_cross_track < cross_tracks[best_law_method],
            f"Cross-track {cross_tracks[MODEL_FOLLOWING_METHOD]:.2g} with the true lag and dead"
            f" time, at most {worst_cross_track:.2g} with wrong ones; the best of the others has"
            f" {cross_tracks[best_law_method]:.2g}.",
        ),
        Finding(
            "ours",
            "model-following keeps the limit of the tilt rate.",
            largest_rate <= MAX_TILT_RATE * (1.0 + _ROUNDING),
            f"With W_M = {MAX_TILT_RATE:.3f} rad/s it commands at most {largest_rate:.3f} rad/s,"
            f" cross-track {limited_cross_track:.2g}.",
        ),
    )


def _grid_finding(grid: Grid) -> Finding:
    ratios = {cell: each.cross_track / each.best_other_cross_track for cell, each in grid.items()}
    closest_cell = max(ratios, key=lambda cell: ratios[cell])
    largest_cross_track = max(comparison.cross_track for comparison in grid.values())
    return Finding(
        "ours",
        "With the true lag and dead time model-following is the straightest over the whole grid.",
        ratios[closest_cell] < 1.0,
        f"Its cross-track is at most {largest_cross_track:.2g}. Compared with the best other"
        " method it is"
        f" largest at {closest_cell}: {ratios[closest_cell]:.2g} times as much.",
    )


def _wrong_delays_finding(grid: Grid) -> Finding:
    worst_cell = max(grid, key=lambda cell: grid[cell].ratio)
    comparison = grid[worst_cell]
    worse_cells = [cell for cell, cell_comparison in grid.items() if cell_comparison.ratio >= 1.0]
    worse_cells_text = (
        f", from {min(cell.dead_time_ms for cell in worse_cells)} ms of dead time on"
        if worse_cells
        else ""
    )
    return Finding(
        "ours",
        "Over the grid model-following is the straightest even with lag and dead time wrong by"
        " ±50 %, in every combination.",
        not worse_cells,
        f"Worse than the best other method in {len(worse_cells)} of {len(grid)}"
        f" cells{worse_cells_text}."
        f" The largest ratio is at {worst_cell}, with {comparison.worst_error}:"
        f" {comparison.worst_cross_track:.2g} against {comparison.best_other_cross_track:.2g} of"
        f" {comparison.best_other.label}.",
    )


def _long_or_short_delays_finding(grid: Grid, complete: CompleteLoopFlights) -> Finding:
    too_short, too_long = DelayMismatch(-0.5, -0.5), DelayMismatch(0.5, 0.5)
    score_pairs = [
        (comparison.model_following_scores[too_long], comparison.model_following_scores[too_short])
        for cell, comparison in grid.items()
        if cell.dead_time_ms > 0
    ]
    worst_if_too_long = max(long_score.cross_track for long_score, _ in score_pairs)
    worst_if_too_short = max(short_score.cross_track for _, short_score in score_pairs)
    straighter_count = sum(
        long_score.cross_track < short_score.cross_track for long_score, short_score in score_pairs
    )
    loop_scores = complete.by_rate[SHOWN_RATE_HZ].model_following_scores
    return Finding(
        "ours",
        "A lag and dead time 50 % too long are better than both 50 % too short.",
        worst_if_too_long < worst_if_too_short
        and loop_scores[too_long].cross_track < loop_scores[too_short].cross_track,
        f"Largest cross-track: too long {worst_if_too_long:.2g}, too short"
        f" {worst_if_too_short:.2g}; with the"
        f" complete inner loop {loop_scores[too_long].cross_track:.2g} and"
        f" {loop_scores[too_short].cross_track:.2g}. Too long is straighter in"
        f" {straighter_count} of"
        f" the {len(score_pairs)} cells with a dead time.",
    )


def _complete_loop_findings(
    complete: CompleteLoopFlights, fit_deviations: dict[Method, float]
) -> tuple[Finding, Finding, Finding]:
    by_rate = complete.by_rate
    cross_tracks = {
        m: method_score.cross_track for m, method_score in by_rate[SHOWN_RATE_HZ].by_method.items()
    }
    nearest_to_model = min(LAW_METHODS, key=lambda method: fit_deviations[method])
    worst_rate = max(by_rate, key=lambda rate: by_rate[rate].ratio)
    comparison = by_rate[worst_rate]
    return (
        Finding(
            "ours",
            "With the complete inner loop and transport delay model-following is the straightest"
            " at every sample rate.",
            all(each.cross_track < each.best_other_cross_track for each in by_rate.values()),
            f"Cross-track at {SHOWN_RATE_HZ:.0f} Hz {cross_tracks[MODEL_FOLLOWING_METHOD]:.2g};"
            f" first-order {cross_tracks[PROPOSED]:.2g}, quaternion"
            f" {cross_tracks[QUATERNION]:.2g}.",
        ),
        Finding(
            "ours",
            "With the complete inner loop model-following is the straightest even with the fitted"
            " lag and dead time wrong by up to ±50 %.",
            comparison.ratio < 1.0,
            f"The largest ratio is at {worst_rate:.0f} Hz, with {comparison.worst_error}:"
            f" {comparison.worst_cross_track:.2g} against {comparison.best_other_cross_track:.2g}"
            f" of {comparison.best_other.label}.",
        ),
        Finding(
            "ours",
            "With the complete inner loop the response of model-following is the nearest to second"
            " order with dead time.",
            fit_deviations[MODEL_FOLLOWING_METHOD] < fit_deviations[nearest_to_model],
            f"It stays within {fit_deviations[MODEL_FOLLOWING_METHOD]:.2g} of the fitted model;"
            f" {nearest_to_model.label}, the next, within {fit_deviations[nearest_to_model]:.2g}.",
        ),
    )
