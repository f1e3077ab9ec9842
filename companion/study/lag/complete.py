"""The complete inner loop of figure 5, with a transport delay, over sample rates and beliefs."""

from typing import NamedTuple

from companion.study.fit import FIT_COLUMNS, SecondOrderFit, fit_second_order, second_order_path
from companion.study.inner_loop import InnerLoop
from companion.study.lag.belief import FINER, Belief, Times, belief_table, beliefs, planner_told
from companion.study.lag.flown import (
    METHODS,
    OTHERS,
    RATES_HZ,
    SCORE_COLUMNS,
    Score,
    score,
    score_of,
    step_at,
)
from companion.study.measures import largest_deviation
from companion.study.methods import FOLLOWING, Method
from companion.study.outcome import Tick
from companion.study.step import Response, fly_loop
from companion.study.table import Cell, Table

LOOP = InnerLoop(transport_delay=0.02)
TIMES = Times(
    lag=0.047,
    dead_time=0.040 + LOOP.transport_delay,
    yaw_lag=0.37,
    yaw_dead_time=0.102 + LOOP.transport_delay,
)
"""First order and dead time as fitted to the measured PX4, and the transport delay."""
TOLD_AT_HZ = 250.0
PARTS = len(RATES_HZ)


class Fitted(NamedTuple):
    """A response, and the second-order model with dead time that it comes nearest to."""

    response: Response
    fit: SecondOrderFit
    from_fit: float  # largest deviation from that model


class AtRate(NamedTuple):
    """What was flown at one sample rate.

    Attributes:
        right: every method, model-following with the fitted times.
        believed: cross-track of model-following by its error, none included.
    """

    right: dict[Method, Response]
    believed: dict[Belief, float]

    def score(self, method: Method) -> Score:
        """Score of a method, model-following with the fitted times."""
        return score(self.right[method])

    @property
    def best_other(self) -> Method:
        """The straightest of the methods that know nothing of the rate loop."""
        return min(OTHERS, key=lambda method: self.score(method).cross_track)

    @property
    def worst_belief(self) -> Belief:
        """What model-following believes where it bends the line most."""
        return max(self.believed, key=lambda belief: self.believed[belief])


Complete = dict[float, AtRate]
"""By sample rate, Hz."""


def fly_complete(tick: Tick) -> Complete:
    """Fly every method at every rate, and model-following with wrong times."""
    complete = {}
    for rate in RATES_HZ:
        tick(f"complete inner loop at {rate:.0f} Hz")
        complete[rate] = AtRate(
            {m: fly_loop(planner_told(m, TIMES), step_at(rate), LOOP) for m in METHODS},
            {
                belief: score_of(
                    planner_told(FOLLOWING, TIMES.believed(belief)), LOOP, rate
                ).cross_track
                for belief in beliefs(FINER)
            },
        )
    return complete


def fit_all(complete: Complete) -> dict[Method, Fitted]:
    """The second-order models of the responses at 250 Hz."""
    step = step_at(TOLD_AT_HZ)
    fitted = {}
    for method, response in complete[TOLD_AT_HZ].right.items():
        fit = fit_second_order(step, response.at(0))
        model = second_order_path(step, fit, step.time)
        fitted[method] = Fitted(response, fit, float(largest_deviation(response, model)[0]))
    return fitted


def fit_table(fitted: dict[Method, Fitted]) -> Table:
    """Score and nearest model of every method at 250 Hz."""
    return Table(
        "lag-inner-loop",
        f"The complete inner loop with 20 ms of transport delay, {TOLD_AT_HZ:.0f} Hz, heading 0,"
        " and the second-order model with dead time that each response comes nearest to.",
        ("method", *SCORE_COLUMNS, *FIT_COLUMNS, "largest deviation from it"),
        tuple(
            (method.label, *score(flown.response), *flown.fit.cells, flown.from_fit)
            for method, flown in fitted.items()
        ),
    )


def rates_table(complete: Complete) -> Table:
    """Cross-track of every method by rate, and of model-following with the worst wrong times."""
    rows: list[tuple[Cell, ...]] = [
        (m.label, *(at.score(m).cross_track for at in complete.values())) for m in METHODS
    ]
    worst = (at.believed[at.worst_belief] for at in complete.values())
    rows.append(("model-following, worst knowledge", *worst))
    return Table(
        "lag-inner-loop-rates",
        "Cross-track with the complete inner loop by sample rate; below, model-following with both"
        " times wrong by up to ±50 %, the worst of all combinations.",
        ("method", *(f"{rate:.0f} Hz" for rate in RATES_HZ)),
        tuple(rows),
    )


def wrong_table(complete: Complete) -> Table:
    """model-following with wrong times at 250 Hz."""
    return belief_table(
        "lag-inner-loop-wrong-knowledge",
        "Cross-track of model-following with the complete inner loop at"
        f" {TOLD_AT_HZ:.0f} Hz, by the error of its lags (rows) and of its dead times (columns)"
        " against those fitted to the inner loop.",
        complete[TOLD_AT_HZ].believed,
    )


def series(complete: Complete) -> Table:
    """Every belief at every rate."""
    return Table(
        "lag-inner-loop-beliefs",
        "Cross-track of model-following with the complete inner loop, by rate and error.",
        ("rate, Hz", "error of the lag", "error of the dead time", "cross-track"),
        tuple(
            (rate, *belief, flown)
            for rate, at in complete.items()
            for belief, flown in at.believed.items()
        ),
    )
