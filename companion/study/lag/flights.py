"""Flies every planner with a slow rate loop; model-following gets true or wrong loop delays."""

from dataclasses import replace
from itertools import product
from math import pi
from typing import NamedTuple

from companion.attitude import Limits, Planner, make_planner
from companion.study.inner_loop import InnerLoop
from companion.study.lag_loop import LagLoop
from companion.study.measures import cross_track, settling_time
from companion.study.methods import LAW_METHODS, MODEL_FOLLOWING_METHOD, Method
from companion.study.outcome import Row, Tick
from companion.study.step import FIGURE_2, Loop, Response, fly_loop

METHODS = (*LAW_METHODS, MODEL_FOLLOWING_METHOD)
"""All methods; only model-following uses lag and dead time of the rate loop."""
RATES_HZ = (50.0, 100.0, 250.0)
DEAD_TIMES_MS = (0, 20, 40, 60, 80)
LAGS_MS = (10, 25, 40, 60)
EXAMPLE_LOOP = LagLoop(lag_ms=25, dead_time_ms=45)
"""Rate loop of the example: its lag is between ArduPilot's (22 ms) and PX4's (47 ms), its dead time
above PX4's (40 ms)."""
EXAMPLE_RATES_HZ = (100.0, 250.0)
EXAMPLE_ERRORS_HZ = 100.0  # sample rate of the flights with wrong lag and dead time
MAX_TILT_RATE = pi / 2.0
"""Limit W_M of the tilt rate √(ω_x² + ω_y²) in the flights with a limit, rad/s."""

COMPLETE_LOOP = InnerLoop(transport_delay=0.02)
SHOWN_RATE_HZ = 250.0  # sample rate of the flights with the complete inner loop in the figure


class DelayMismatch(NamedTuple):
    """Relative errors of the assumed lag and dead time; 0.5: 50 % longer than the true value."""

    lag: float
    dead_time: float

    def __str__(self) -> str:
        return f"lag {in_percent(self.lag)} and dead time {in_percent(self.dead_time)}"

    @property
    def cells(self) -> Row:
        """The cells of this error in a table."""
        return {"error of the lag": self.lag, "error of the dead time": self.dead_time}


NO_ERROR = DelayMismatch(0.0, 0.0)
GRID_ERRORS = (-0.5, 0.0, 0.5)
FINE_ERRORS = (-0.5, -0.3, 0.0, 0.3, 0.5)  # in the example and with the complete inner loop


class RateLoopDelays(NamedTuple):
    """Lags and dead times of a rate loop, s, named like the options of `model-following`."""

    lag: float
    dead_time: float
    yaw_lag: float
    yaw_dead_time: float

    def with_error(self, error: DelayMismatch) -> "RateLoopDelays":
        """These lags and dead times, wrong by the relative errors `error`."""
        factors = 2 * (1.0 + error.lag, 1.0 + error.dead_time)
        return RateLoopDelays(*(f * delay for f, delay in zip(factors, self, strict=True)))


COMPLETE_DELAYS = RateLoopDelays(
    lag=0.047,
    dead_time=0.040 + COMPLETE_LOOP.transport_delay,
    yaw_lag=0.37,
    yaw_dead_time=0.102 + COMPLETE_LOOP.transport_delay,
)
"""Lag and dead time fitted to the measured response of PX4, with the transport delay added."""


class Score(NamedTuple):
    """How straight and how fast a response is."""

    cross_track: float
    """Largest distance of the acceleration coefficients (no unit) from the line start → target."""
    settling_time: float
    """Time from which the distance to the target stays within 5 % of the step, s."""

    @property
    def cells(self) -> Row:
        """The cells of this score in a table."""
        return {"cross-track": self.cross_track, "time to 5 %, s": self.settling_time}


class Comparison(NamedTuple):
    """Scores with one rate loop at one sample rate."""

    other_scores: dict[Method, Score]
    """Score of each method of `LAW_METHODS`."""
    model_following_scores: dict[DelayMismatch, Score]
    """Score of model-following for each error of its lag and dead time, also for `NO_ERROR`."""

    @property
    def by_method(self) -> dict[Method, Score]:
        """Score of every method; model-following assumes the true lag and dead time."""
        return {**self.other_scores, MODEL_FOLLOWING_METHOD: self.model_following_scores[NO_ERROR]}

    @property
    def best_other(self) -> Method:
        """The method of `LAW_METHODS` with the smallest cross-track error."""
        return min(self.other_scores, key=lambda method: self.other_scores[method].cross_track)

    @property
    def best_other_cross_track(self) -> float:
        """Smallest cross-track error of the methods of `LAW_METHODS`."""
        return self.other_scores[self.best_other].cross_track

    @property
    def cross_track(self) -> float:
        """Cross-track error of model-following with the true lag and dead time."""
        return self.model_following_scores[NO_ERROR].cross_track

    @property
    def worst_error(self) -> DelayMismatch:
        """The wrong lag and dead time that give model-following its largest cross-track error."""
        errors = [error for error in self.model_following_scores if error != NO_ERROR]
        return max(errors, key=lambda error: self.model_following_scores[error].cross_track)

    @property
    def worst_cross_track(self) -> float:
        """Largest cross-track error of model-following with a wrong lag or dead time."""
        return self.model_following_scores[self.worst_error].cross_track

    @property
    def ratio(self) -> float:
        """`worst_cross_track` / `best_other_cross_track`; below 1 model-following is better."""
        return self.worst_cross_track / self.best_other_cross_track


class GridCell(NamedTuple):
    """Conditions of a comparison in the grid: sample rate, dead time and lag of the rate loop."""

    rate_hz: float
    dead_time_ms: int
    lag_ms: int

    def __str__(self) -> str:
        return f"dead time {self.dead_time_ms} ms, lag {self.lag_ms} ms, {self.rate_hz:.0f} Hz"


Grid = dict[GridCell, Comparison]


class Example(NamedTuple):
    """The results of the flights with `EXAMPLE_LOOP`."""

    unlimited_responses: dict[float, dict[Method, Response]]
    """Responses of every method by sample rate (Hz), without limits."""
    rate_limited_responses: dict[float, Response]
    """Responses of model-following with the limit `MAX_TILT_RATE`, by sample rate (Hz)."""
    model_following_scores: dict[DelayMismatch, Score]
    """As `Comparison.model_following_scores`, at the sample rate `EXAMPLE_ERRORS_HZ`."""


class CompleteLoopFlights(NamedTuple):
    """The results of the flights with the complete inner loop (`companion.study.inner_loop`)."""

    by_rate: dict[float, Comparison]
    """Comparison at each sample rate (Hz)."""
    shown_responses: dict[Method, Response]
    """Responses of every method at `SHOWN_RATE_HZ`."""


def in_percent(error: float) -> str:
    """A relative error for tables and legends, such as `+50 %`; `right` if the error is 0."""
    return f"{100.0 * error:+.0f} %".replace("-", "−") if error else "right"


def score(response: Response) -> Score:
    """The score of a response at its first heading."""
    return Score(float(cross_track(response)[0]), float(settling_time(response)[0]))


def fly_grid(tick: Tick) -> Grid:
    """Fly every method in every cell, model-following also with lag and dead time wrong by 50 %."""
    grid = {}
    for dead_time, lag in product(DEAD_TIMES_MS, LAGS_MS):
        tick(f"dead time {dead_time} ms, lag {lag} ms")
        loop = LagLoop(lag, dead_time)
        delays = _delays_of(loop)
        errors = [error for error in _error_pairs(GRID_ERRORS) if dead_time or not error.dead_time]
        for rate in RATES_HZ:
            grid[GridCell(rate, dead_time, lag)] = Comparison(
                {m: score(_fly(m, delays, loop, rate)) for m in LAW_METHODS},
                _scores_with_errors(errors, delays, loop, rate),
            )
    return grid


def fly_example() -> Example:
    """Fly the example with every method, with a rate limit, and with wrong lag and dead time."""
    loop, limits = EXAMPLE_LOOP, Limits(max_tilt_rate=MAX_TILT_RATE)
    delays = _delays_of(loop)
    return Example(
        {hz: {m: _fly(m, delays, loop, hz) for m in METHODS} for hz in EXAMPLE_RATES_HZ},
        {hz: _fly(MODEL_FOLLOWING_METHOD, delays, loop, hz, limits) for hz in EXAMPLE_RATES_HZ},
        _scores_with_errors(_error_pairs(FINE_ERRORS), delays, loop, EXAMPLE_ERRORS_HZ),
    )


def fly_complete_loop(tick: Tick) -> CompleteLoopFlights:
    """Fly every method at every rate, model-following also with wrong lag and dead time."""
    responses, by_rate = {}, {}
    for rate in RATES_HZ:
        tick(f"complete inner loop at {rate:.0f} Hz")
        responses[rate] = {m: _fly(m, COMPLETE_DELAYS, COMPLETE_LOOP, rate) for m in METHODS}
        by_rate[rate] = Comparison(
            {method: score(responses[rate][method]) for method in LAW_METHODS},
            _scores_with_errors(_error_pairs(FINE_ERRORS), COMPLETE_DELAYS, COMPLETE_LOOP, rate),
        )
    return CompleteLoopFlights(by_rate, responses[SHOWN_RATE_HZ])


def _error_pairs(errors: tuple[float, ...]) -> list[DelayMismatch]:
    """Every pair of an error of the lag and an error of the dead time."""
    return [DelayMismatch(*pair) for pair in product(errors, repeat=2)]


def _delays_of(loop: LagLoop) -> RateLoopDelays:
    """The true lag and dead time of a loop that is the same on every axis."""
    return RateLoopDelays(*2 * (1e-3 * loop.lag_ms, 1e-3 * loop.dead_time_ms))


def _scores_with_errors(
    errors: list[DelayMismatch], delays: RateLoopDelays, loop: Loop, rate_hz: float
) -> dict[DelayMismatch, Score]:
    return {
        error: score(_fly(MODEL_FOLLOWING_METHOD, delays.with_error(error), loop, rate_hz))
        for error in errors
    }


def _fly(
    method: Method,
    delays: RateLoopDelays,
    loop: Loop,
    rate_hz: float,
    limits: Limits = Limits(),  # noqa: B008  (frozen)
) -> Response:
    """Fly a method; only model-following uses `delays`, the lag and dead time that it assumes."""
    options = delays._asdict() if method is MODEL_FOLLOWING_METHOD else {}
    planner: Planner = make_planner(method.planner, FIGURE_2.gain, limits=limits, **options)
    # One heading is enough: at another one only `euler` responds differently.
    step = replace(FIGURE_2, headings=(0.0,), rate_hz=rate_hz)
    return fly_loop(planner, step, loop)
