"""The nearest second-order model, against responses made by SciPy from known ones."""

import numpy as np
import pytest
from scipy.linalg import expm

from companion.recording.measurements.response import measure_response
from companion.recording.measurements.second_order import StepRun, nearest_second_order, step_runs
from tests.attitude.independent import attitudes

STILL = ((0.0, 0.0), (0.0, 0.0))


def answered(times, targets, frequency, damping, dead_time, start=STILL):
    """(n, 2) coefficients at irregular times; each target was asked for at its own row's time.

    `start` is c and ċ, which keeps its speed until the first target has effect.
    """
    matrix = np.array([[0.0, 1.0], [-(frequency**2), -2.0 * damping * frequency]])

    def after(seconds, state, target):
        """States (m, 2, 2) under a target, which is None before the first."""
        seconds = np.reshape(seconds, (-1, 1, 1))
        if target is None:
            return state + seconds * [state[1], (0.0, 0.0)]
        goal = np.array([target, (0.0, 0.0)])
        return exponentials(matrix, seconds) @ (state - goal) + goal

    changes = [0, *(np.flatnonzero(np.any(np.diff(targets, axis=0), axis=1)) + 1)]
    knots = [times[0], *(times[k] + dead_time for k in changes)]
    state, rows = np.array(start, dtype=float), np.empty((len(times), 2))
    for since, until, target in zip(
        knots, [*knots[1:], times[-1]], [None, *(targets[k] for k in changes)], strict=True
    ):
        inside = (times >= since) & (times <= until)
        rows[inside] = after(times[inside] - since, state, target)[:, 0]
        (state,) = after(until - since, state, target)
    return rows


def exponentials(matrix, seconds):
    """e^(matrix·t) for each t of (m, 1, 1); by eigenvalues, which is quicker, where they differ."""
    values, vectors = np.linalg.eig(matrix)
    if abs(values[0] - values[1]) < 1e-3:
        return expm(matrix * seconds)
    return ((vectors * np.exp(values * seconds)) @ np.linalg.inv(vectors)).real


def run_of(model, *, hold=1.0, steps=3, rate_hz=100, seed=1, noise=0.0, start=STILL, begin=5.0):
    """Steps between corners, sampled unevenly, the measured coefficients noisy."""
    rng = np.random.default_rng(seed)
    times = begin + np.cumsum(rng.uniform(0.5, 1.5, int(steps * hold * rate_hz)) / rate_hz)
    corners = 0.3 * np.array([(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)])
    targets = corners[np.minimum((times - times[0]) / hold, steps - 1).astype(int) % 4]
    measured = answered(times, targets, *model, start=start)
    return StepRun(times, measured + rng.normal(0.0, noise, measured.shape), targets)


def found(*runs):
    fit = nearest_second_order(list(runs))
    return fit.frequency, fit.damping, fit.dead_time


MODELS = [(9.0, 0.8, 0.057), (6.0, 1.0, 0.11), (15.0, 0.6, 0.04), (8.0, 2.0, 0.08)]


@pytest.mark.parametrize("model", MODELS)
def test_a_known_model_is_found(model):
    assert found(run_of(model)) == pytest.approx(model, rel=1e-3, abs=1e-4)


def test_it_is_found_in_noise_and_steps_that_do_not_settle():
    run = run_of(MODELS[0], hold=0.25, steps=12, noise=4e-4)
    assert found(run) == pytest.approx(MODELS[0], rel=0.02, abs=0.001)


def test_it_is_found_from_a_start_that_wind_has_tilted_and_is_moving():
    run = run_of(MODELS[0], start=((0.1, -0.05), (-0.2, 0.1)))
    assert found(run) == pytest.approx(MODELS[0], rel=2e-3, abs=2e-4)
    assert nearest_second_order([run]).path(run) == pytest.approx(run.measured, abs=1e-3)


def test_one_model_serves_all_runs():
    one = run_of(MODELS[0], steps=2)
    other = run_of(MODELS[0], steps=2, seed=2, begin=20.0)
    assert found(one, other) == pytest.approx(MODELS[0], rel=1e-3, abs=1e-4)
    mixed = nearest_second_order([one, run_of(MODELS[1], steps=2, seed=2, begin=20.0)])
    assert MODELS[1][0] < mixed.frequency < MODELS[0][0]


def test_of_a_first_order_response_behind_a_dead_time_nothing_is_left_over():
    times = np.arange(0.0, 3.0, 0.01)
    targets = np.outer(np.where(times < 1.5, 0.2, -0.2), (1.0, 0.0))
    first, second = (1.0 - np.exp(-np.maximum(times - at, 0.0) / 0.3) for at in (0.04, 1.54))
    along = 0.2 * first - 0.4 * second
    run = StepRun(times, np.outer(along, (1.0, 0.0)), targets)
    fit = nearest_second_order([run])
    assert np.abs(fit.path(run) - run.measured).max() < 0.003
    assert 2.0 * fit.damping / fit.frequency + fit.dead_time == pytest.approx(0.34, rel=0.02)


def test_the_largest_deviation_is_seen_between_the_rows_that_were_searched():
    run = run_of(MODELS[0], rate_hz=500)
    assert run.time.size > 1200
    run.measured[701] += (0.03, 0.04)
    response = measure_response(rows_of(run), gain=5.0)
    assert response.second_order_deviation_max == pytest.approx(0.05, rel=0.03)
    assert response.second_order.frequency == pytest.approx(MODELS[0][0], rel=0.01)


def rows_of(run):
    """The same as `FlightTrace.response` holds it."""
    q = attitudes(run.measured, np.full(run.time.size, 0.4)).as_quat(scalar_first=True)
    return np.column_stack((run.time, q, run.target))


def test_steps_are_taken_apart_at_pauses_and_changes_of_the_target():
    first = run_of(MODELS[0], hold=0.5, steps=3)
    second = run_of(MODELS[0], hold=0.5, steps=2, begin=20.0)
    scrap = StepRun(*(column[:5] for column in run_of(MODELS[0], begin=40.0)))
    runs = step_runs(np.vstack([rows_of(run) for run in (first, second, scrap)]))
    assert [run.time.size for run in runs] == [first.time.size, second.time.size]
    assert runs[0].measured == pytest.approx(first.measured, abs=1e-12)
    steps = runs[0].steps()
    assert [len(np.unique(step.target, axis=0)) for step in steps] == [1, 1, 1]
    assert sum(step.time.size for step in steps) == first.time.size
