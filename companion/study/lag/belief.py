"""What model-following is told of the rate loop, rightly or wrongly."""

from itertools import product
from typing import NamedTuple

from companion.attitude import Limits, Planner, make_planner
from companion.study.methods import FOLLOWING, Method
from companion.study.step import FIGURE_2
from companion.study.table import Table


class Belief(NamedTuple):
    """By which share of the truth a time is taken for longer than it is; 0 is right.

    Attributes:
        lag: of the lags.
        dead_time: of the dead times.
    """

    lag: float
    dead_time: float


class Times(NamedTuple):
    """Lag and dead time of a rate loop by axis, s, under the names that the planner takes."""

    lag: float
    dead_time: float
    yaw_lag: float
    yaw_dead_time: float

    def believed(self, belief: Belief) -> "Times":
        """These times as they are believed to be."""
        lag, dead_time = 1.0 + belief.lag, 1.0 + belief.dead_time
        return Times(
            lag * self.lag,
            dead_time * self.dead_time,
            lag * self.yaw_lag,
            dead_time * self.yaw_dead_time,
        )


RIGHT = Belief(0.0, 0.0)
HALF_OFF = (-0.5, 0.0, 0.5)
"""Shares that are tried everywhere."""
FINER = (-0.5, -0.3, 0.0, 0.3, 0.5)
"""Shares that are tried where a case is told in full."""


def beliefs(shares: tuple[float, ...]) -> tuple[Belief, ...]:
    """Every combination of these shares for lag and dead time."""
    return tuple(Belief(*pair) for pair in product(shares, repeat=2))


def planner_told(method: Method, times: Times, limits: Limits = Limits()) -> Planner:  # noqa: B008
    """A planner of this method; only model-following is told the times of the rate loop."""
    options = times._asdict() if method is FOLLOWING else {}
    return make_planner(method.planner, FIGURE_2.gain, limits=limits, **options)


def in_percent(share: float) -> str:
    """A share as it stands in tables and legends."""
    return f"{100.0 * share:+.0f} %".replace("-", "−") if share else "right"


def belief_table(name: str, caption: str, wrong: dict[Belief, float]) -> Table:
    """Cross-track by the error of the lag (rows) and of the dead time (columns)."""
    return Table(
        name,
        caption,
        ("lag", *(f"dead time {in_percent(error)}" for error in FINER)),
        tuple(
            (in_percent(lag), *(wrong[Belief(lag, dead_time)] for dead_time in FINER))
            for lag in FINER
        ),
    )
