"""The steps of a flight, and the second-order model with a dead time that fits them best."""

from dataclasses import dataclass
from math import exp, log
from typing import NamedTuple

import numpy as np

from companion.attitude import coefficients
from companion.least_squares import Floats, minimise, project

_LONGEST_GAP = 0.5
"""Rows further apart than this belong to different runs, s."""
_MAX_ROWS_OF_SHORT_RUN = 10
"""Largest number of rows of a run that is too short to measure."""
_COMPASS = (
    *("north", "north-east", "east", "south-east"),
    *("south", "south-west", "west", "north-west"),
)


class StepRun(NamedTuple):
    """Steps flown without a pause between them, such as a doublet."""

    time: Floats
    """(n,), vehicle time, s, rising."""
    measured: Floats
    """(n, 2), coefficients north and east."""
    target: Floats
    """(n, 2), target coefficients when the setpoint for the row's sample was computed."""

    @property
    def changes(self) -> Floats:
        """(n, 2), targets minus the coefficients measured first, which are not 0 in wind."""
        from_start: Floats = self.target - self.measured[0]
        return from_start

    @property
    def largest_change(self) -> float:
        """Length of the largest of the `changes`."""
        return largest_norm(self.changes)

    @property
    def direction(self) -> Floats:
        """(2,), direction of the first of the `changes` in the plane of the coefficients."""
        first_change: Floats = self.changes[0]
        return first_change / max(float(np.hypot(*first_change)), 1e-9)

    @property
    def compass_point(self) -> str:
        """The nearest of the eight points of the compass to `direction`, such as "north-west"."""
        north, east = self.direction
        return _COMPASS[round(4.0 * float(np.arctan2(east, north)) / np.pi) % 8]

    def steps(self) -> list["StepRun"]:
        """The single steps: each from one change of the target to the next."""
        changes = np.flatnonzero(np.any(np.diff(self.target, axis=0), axis=1)) + 1
        columns = [np.split(column, changes) for column in self]
        return [StepRun(*parts) for parts in zip(*columns, strict=True)]


def largest_norm(coefficients: Floats) -> float:
    """The largest length of coefficients (n, 2)."""
    return float(np.hypot(*coefficients.T).max())


def step_runs(rows: Floats) -> list[StepRun]:
    """Rows (N, 7) of `FlightTrace.response`, split at gaps in time, without too short parts."""
    if len(rows) == 0:
        return []
    parts = np.split(rows, np.flatnonzero(np.diff(rows[:, 0]) > _LONGEST_GAP) + 1)
    return [
        StepRun(part[:, 0], np.array([coefficients(tuple(row[1:5])) for row in part]), part[:, 5:7])
        for part in parts
        if len(part) > _MAX_ROWS_OF_SHORT_RUN
    ]


_FITTED_ROWS = 600
"""Approximate number of rows used to find the model."""
_LAG_RANGE, _DAMPING_RANGE, _DEAD_TIME_RANGE = (0.02, 4.0), (0.2, 10.0), (0.0, 0.5)
"""Ranges in which 2ζ/ω (s), ζ and the dead time (s) are searched. ζ = 10 is almost first order."""
_TRIED_LAGS, _TRIED_DAMPINGS = np.geomspace(0.05, 1.0, 5), (0.7, 1.5)
_TRIED_DEAD_TIMES = (0.0, 0.04, 0.1, 0.2)
_TIME_WITHOUT_EFFECT = 0.03
"""Time after the first change of the target in which the change is assumed to have no effect, s.
The rows in this time give the coefficients and their rate of change at the start of the model."""


@dataclass(frozen=True, slots=True)
class SecondOrderModel:
    """Second-order model with dead time: c̈ = ω²·(c_d(t − dead time) − c) − 2ζω·ċ."""

    frequency: float
    """Natural frequency ω, rad/s."""
    damping: float
    """Damping ratio ζ."""
    dead_time: float
    """Time from a change of the target (its first sample) until the response begins, s."""

    def path(self, run: StepRun) -> Floats:
        """(n, 2) coefficients of the model at the rows of `run`.

        The path starts with the measured coefficients and their measured rate of change, and keeps
        this rate until the first target has an effect.
        """
        return self.path_at_rows(RunForModel.from_run(run))

    def path_at_rows(self, run: "RunForModel") -> Floats:
        """(m, 2), coefficients of the model at the times in `run`; see `path`."""
        time, effect_times = run.time, run.change_times + self.dead_time
        target_index = np.searchsorted(effect_times, time, side="right") - 1
        elapsed = np.maximum(time - effect_times[np.maximum(target_index, 0)], 0.0)
        to_row_times = self._transitions(elapsed)[:, 0]
        to_next_target = self._transitions(np.diff(effect_times))
        start_coefficients, start_rate = run.start
        path: Floats = start_coefficients + np.outer(time, start_rate)
        state = np.array([start_coefficients + self.dead_time * start_rate, start_rate])
        for index, target in enumerate(run.targets):
            target_state = np.array([target, (0.0, 0.0)])
            is_for_target = target_index == index
            path[is_for_target] = to_row_times[is_for_target] @ (state - target_state) + target
            if index < len(to_next_target):
                state = to_next_target[index] @ (state - target_state) + target_state
        return path

    def _transitions(self, seconds: Floats) -> Floats:
        """(m, 2, 2), `SecondOrderReference.transition` over each of these durations (m,), s."""
        decay, square = self.damping * self.frequency, self.frequency * self.frequency
        omega_d = np.sqrt(complex(square * (1.0 - self.damping * self.damping)))
        slower = np.exp((-1j * omega_d - decay) * seconds)  # of the two: nothing overflows
        cosine = (0.5 * slower * (1.0 + np.exp(2j * omega_d * seconds))).real
        sine = (
            (slower * np.expm1(2j * omega_d * seconds) / (2j * omega_d)).real
            if omega_d
            else cosine * seconds
        )
        matrix_rows = (cosine + decay * sine, sine), (-square * sine, cosine - decay * sine)
        return np.moveaxis(np.array(matrix_rows), -1, 0)


class RunForModel(NamedTuple):
    """The data of a run that a model needs."""

    time: Floats
    """(m,), times of the rows since the first row of the run, s."""
    start: Floats
    """(2, 2), coefficients and their rate of change (1/s), measured before the first step acts."""
    change_times: Floats
    """(s,), time of each change of the target since the first row of the run, s; the first is 0."""
    targets: Floats
    """(s, 2), coefficients of each target."""

    @classmethod
    def from_run(cls, run: StepRun, thinning: int = 1) -> "RunForModel":
        """The data of a run at every `thinning`-th row."""
        time_in_run, steps = run.time - run.time[0], run.steps()
        is_before_effect = time_in_run <= _TIME_WITHOUT_EFFECT
        line_columns = np.column_stack(
            (np.ones(int(is_before_effect.sum())), time_in_run[is_before_effect])
        )
        start, _ = project(line_columns, run.measured[is_before_effect])
        change_times = np.array([step.time[0] for step in steps]) - run.time[0]
        targets = np.array([step.target[0] for step in steps])
        return cls(time_in_run[::thinning], start, change_times, targets)


def nearest_second_order(runs: list[StepRun]) -> SecondOrderModel:
    """The second-order model that fits the runs best: least squares over ω, ζ and dead time."""
    thinning = 1 + sum(run.time.size for run in runs) // _FITTED_ROWS
    thinned_runs = [RunForModel.from_run(run, thinning) for run in runs]
    measured = np.concatenate([run.measured[::thinning] for run in runs])

    def residuals(parameters: Floats) -> tuple[Floats, Floats]:
        fit = _second_order_model(parameters)
        paths = np.concatenate([fit.path_at_rows(run) for run in thinned_runs])
        return np.empty(0), (measured - paths).ravel()

    grid = [
        np.array([log(lag), log(damping), dead_time])
        for lag in _TRIED_LAGS
        for damping in _TRIED_DAMPINGS
        for dead_time in _TRIED_DEAD_TIMES
    ]
    best_grid_point = min(grid, key=lambda point: float(np.sum(residuals(point)[1] ** 2)))
    lower_bounds, upper_bounds = np.array(
        [np.log(_LAG_RANGE), np.log(_DAMPING_RANGE), _DEAD_TIME_RANGE]
    ).T
    return _second_order_model(
        minimise(residuals, best_grid_point, lower_bounds, upper_bounds).unknowns
    )


def _second_order_model(parameters: Floats) -> SecondOrderModel:
    """The model from (log 2ζ/ω, log ζ, dead time), which are less correlated than ω and ζ."""
    damping = exp(parameters[1])
    return SecondOrderModel(2.0 * damping / exp(parameters[0]), damping, float(parameters[2]))
