"""What is measured of every flight of the study."""

from dataclasses import replace
from typing import NamedTuple

from companion.attitude import Planner
from companion.study.measures import cross_track, time_to
from companion.study.methods import EXACT, FOLLOWING, PAPERS
from companion.study.step import FIGURE_2, Loop, Response, Step, fly_loop

METHODS = (*PAPERS, EXACT, FOLLOWING)
OTHERS = tuple(method for method in METHODS if method is not FOLLOWING)
RATES_HZ = (50.0, 100.0, 250.0)
SCORE_COLUMNS = ("cross-track", "time to 5 %, s")


class Score(NamedTuple):
    """How straight and how quick a response is.

    Attributes:
        cross_track: largest distance from the straight line, in coefficients.
        time: until no more than 5 % of the step is left for good, s; inf if never.
    """

    cross_track: float
    time: float


def step_at(rate_hz: float) -> Step:
    """The step of figure 2 at heading 0 alone, which `euler` alone would mind."""
    return replace(FIGURE_2, headings=(0.0,), rate_hz=rate_hz)


def score(response: Response) -> Score:
    """The score at the only heading."""
    return Score(float(cross_track(response)[0]), float(time_to(response)[0]))


def score_of(planner: Planner, loop: Loop, rate_hz: float) -> Score:
    """Fly a planner through a loop, and keep the score alone."""
    return score(fly_loop(planner, step_at(rate_hz), loop))
