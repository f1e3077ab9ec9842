"""What the numbers of the study bear out, and what they do not."""

from companion.study.lag.belief import RIGHT, Belief, in_percent
from companion.study.lag.case import MAX_TILT_RATE, Case
from companion.study.lag.complete import TOLD_AT_HZ, Complete, Fitted
from companion.study.lag.flown import OTHERS, score
from companion.study.lag.grid import Cell, Grid
from companion.study.measures import largest_tilt_rate
from companion.study.methods import FOLLOWING, PROPOSED, QUATERNION, Method
from companion.study.outcome import Finding

_ROUNDING = 1e-9


def find(
    grid: Grid, case: Case, complete: Complete, fitted: dict[Method, Fitted]
) -> tuple[Finding, ...]:
    """All findings, those on the case first."""
    return (
        *_on_the_case(case),
        _over_the_grid(grid),
        _wrong_over_the_grid(grid),
        _rather_too_long(grid, complete),
        *_with_the_complete_loop(complete, fitted),
    )


def _on_the_case(case: Case) -> tuple[Finding, Finding, Finding]:
    across = {m: score(r).cross_track for m, r in case.free[100.0].items()}
    best = min(OTHERS, key=lambda method: across[method])
    worst = max(case.wrong.values())
    rate = max(largest_tilt_rate(response) for response in case.limited.values())
    bent = max(score(response).cross_track for response in case.limited.values())
    return (
        Finding(
            "asked",
            "Behind dead time and lag the proposed method keeps closest to the straight line.",
            across[PROPOSED] <= across[best],
            f"Cross-track at 100 Hz: first-order {across[PROPOSED]:.2g}, {best.label}"
            f" {across[best]:.2g}.",
        ),
        Finding(
            "asked",
            "model-following is the straightest there, and still is with lag and dead time wrongly"
            " known by up to 50 %.",
            worst < across[best],
            f"Cross-track {across[FOLLOWING]:.2g} with the right times, at most {worst:.2g} with"
            f" wrong ones; the best of the others has {across[best]:.2g}.",
        ),
        Finding(
            "asked",
            "It keeps the limit of the tilt rate.",
            rate <= MAX_TILT_RATE * (1.0 + _ROUNDING),
            f"With W_M = {MAX_TILT_RATE:.3f} rad/s it commands at most {rate:.3f} rad/s,"
            f" cross-track {bent:.2g}.",
        ),
    )


def _over_the_grid(grid: Grid) -> Finding:
    def ratio(cell: Cell) -> float:
        place = grid[cell]
        return place.right[FOLLOWING].cross_track / place.right[place.best_other].cross_track

    closest = max(grid, key=ratio)
    bent = max(place.right[FOLLOWING].cross_track for place in grid.values())
    return Finding(
        "asked",
        "With the right times it is the straightest at every dead time, lag and sample rate.",
        ratio(closest) < 1.0,
        f"Cross-track at most {bent:.2g}, and at most {ratio(closest):.2g} of the best other"
        f" method's, at {closest}.",
    )


def _wrong_over_the_grid(grid: Grid) -> Finding:
    last = max(grid, key=lambda cell: grid[cell].ratio)
    place, other = grid[last], grid[last].best_other
    worse = [cell for cell, at in grid.items() if at.ratio >= 1.0]
    where = f", from {min(cell.dead_time_ms for cell in worse)} ms of dead time on" if worse else ""
    return Finding(
        "asked",
        "And with lag and dead time wrong by ±50 %, in every combination, it still is.",
        not worse,
        f"Worse than the best other method in {len(worse)} of {len(grid)} cells{where}. It compares"
        f" worst at {last}, with {_believing(place.worst_belief)}: {place.worst:.2g} against"
        f" {place.right[other].cross_track:.2g} of {other.label}.",
    )


def _rather_too_long(grid: Grid, complete: Complete) -> Finding:
    short, long = Belief(-0.5, -0.5), Belief(0.5, 0.5)
    pairs = [
        (place.wrong[long], place.wrong[short])
        for cell, place in grid.items()
        if cell.dead_time_ms > 0
    ]
    too_long = max(one.cross_track for one, _ in pairs)
    too_short = max(other.cross_track for _, other in pairs)
    straighter = sum(one.cross_track < other.cross_track for one, other in pairs)
    loop = complete[TOLD_AT_HZ].believed
    return Finding(
        "asked",
        "It is better to believe both times 50 % too long than 50 % too short.",
        too_long < too_short and loop[long] < loop[short],
        f"Largest cross-track {too_long:.2g} against {too_short:.2g}, with the complete inner loop"
        f" {loop[long]:.2g} against {loop[short]:.2g}. Too long is the straighter in {straighter}"
        f" of the {len(pairs)} cells with a dead time.",
    )


def _with_the_complete_loop(
    complete: Complete, fitted: dict[Method, Fitted]
) -> tuple[Finding, Finding, Finding]:
    told = complete[TOLD_AT_HZ]
    bent = {method: told.score(method).cross_track for method in told.right}
    apart = {method: flown.from_fit for method, flown in fitted.items()}
    nearest = min(OTHERS, key=lambda method: apart[method])
    shares = {
        rate: at.believed[at.worst_belief] / at.score(at.best_other).cross_track
        for rate, at in complete.items()
    }
    last = max(shares, key=lambda rate: shares[rate])
    at = complete[last]
    return (
        Finding(
            "asked",
            "With the complete inner loop and transport delay it is the straightest, at every"
            " sample rate.",
            all(a.believed[RIGHT] < a.score(a.best_other).cross_track for a in complete.values()),
            f"Cross-track at {TOLD_AT_HZ:.0f} Hz {bent[FOLLOWING]:.2g}; first-order"
            f" {bent[PROPOSED]:.2g}, quaternion {bent[QUATERNION]:.2g}.",
        ),
        Finding(
            "asked",
            "And with the fitted times wrong by up to ±50 % it still is.",
            shares[last] < 1.0,
            f"It compares worst at {last:.0f} Hz, with {_believing(at.worst_belief)}:"
            f" {at.believed[at.worst_belief]:.2g} against"
            f" {at.score(at.best_other).cross_track:.2g} of {at.best_other.label}.",
        ),
        Finding(
            "asked",
            "And nearest to second order with dead time.",
            apart[FOLLOWING] < apart[nearest],
            f"Within {apart[FOLLOWING]:.2g} of its nearest such model; {nearest.label}, the next,"
            f" within {apart[nearest]:.2g}.",
        ),
    )


def _believing(belief: Belief) -> str:
    return f"lag {in_percent(belief.lag)} and dead time {in_percent(belief.dead_time)}"
