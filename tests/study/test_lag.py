"""`companion study lag` as a user runs it: its tables against the plant of the planner's own tests.

Those fly SciPy rotations; nothing of the study is used in them.
"""

import csv
import itertools
from dataclasses import replace

import numpy as np
import pytest

from companion.attitude import Target, make_planner
from companion.cli.main import main
from companion.study.lag import figure, flights
from tests.attitude.independent import attitudes
from tests.attitude.lag_plant import LagPlant, fly

START, GOAL, GAIN = (-0.4, -0.5), (0.4, -0.5), 5.0
ERRORS = (-0.5, 0.0, 0.5)
OTHERS = ("quaternion", "so3", "euler", "first-order", "exact")
DEAD_TIMES, LAGS, RATES = (0, 80), (10, 60), (50, 100, 250)
"""ms and Hz: the grid as flown here, without the places that lie between others."""
SECONDS = 1.0
"""Time flown, here and on the independent plant: every method bends in its first second."""


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lag")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(flights, "DEAD_TIMES_MS", DEAD_TIMES)
        patch.setattr(flights, "LAGS_MS", LAGS)
        patch.setattr(figure, "_CUT_LAG_MS", LAGS[-1])
        patch.setattr(figure, "_CUT_DEAD_TIME_MS", DEAD_TIMES[-1])
        patch.setattr(flights, "FIGURE_2", replace(flights.FIGURE_2, seconds=SECONDS))
        assert main(["study", "lag", "--out", str(folder)]) == 0
    return folder


def rows(out, name):
    with (out / f"{name}.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def key(row, *more):
    names = ("dead time, ms", "lag, ms", "rate, Hz", *more)
    return tuple(float(row[name]) for name in names)


def across(row):
    return float(row["cross-track"])


@pytest.fixture(scope="module")
def right(out):
    """Cross-track by method and (dead time, lag, rate)."""
    return {(row["method"], key(row)): across(row) for row in rows(out, "lag-grid")}


@pytest.fixture(scope="module")
def wrong(out):
    """Cross-track of model-following by (dead time, lag, rate, error of lag, of dead time)."""
    names = ("error of the lag", "error of the dead time")
    return {key(row, *names): across(row) for row in rows(out, "lag-grid-wrong-knowledge")}


def best_other(right, cell):
    return min(right[name, cell] for name in OTHERS)


def judged(name, dead_time_ms, lag_ms, hz, **known):
    """Cross-track on the independent plant."""
    plant = LagPlant(attitudes(START, [0.0]), [1e-3 * lag_ms] * 3, [1e-3 * dead_time_ms] * 3)
    target = [Target(*GOAL, 0.0)]
    planner = make_planner(name, GAIN, **known)
    flight = fly([planner], plant, lambda _: target, round(SECONDS * hz), 1.0 / hz)
    return np.abs(flight.c[..., 1] - GOAL[1]).max()


def test_every_method_is_flown_over_the_whole_grid_and_with_every_wrong_knowledge(right, wrong):
    cells = set(itertools.product(DEAD_TIMES, LAGS, RATES))
    assert set(right) == set(itertools.product((*OTHERS, "model-following"), cells))
    errors = set(itertools.product(ERRORS, ERRORS)) - {(0.0, 0.0)}
    asked = {(*cell, *error) for cell in cells for error in errors if cell[0] or not error[1]}
    assert set(wrong) == asked


@pytest.mark.parametrize("cell", [(0, 60, 100), (80, 10, 50), (80, 60, 250)])
@pytest.mark.parametrize("method", ["first-order", "quaternion"])
def test_the_other_methods_bend_as_on_the_independent_plant(right, method, cell):
    assert right[method, cell] == pytest.approx(judged(method, *cell), rel=0.01)


@pytest.mark.parametrize("cell", [(0, 60, 100), (80, 60, 50), (80, 10, 100)])
@pytest.mark.parametrize("error", [(-0.5, 0.0), (0.5, 0.5), (-0.5, -0.5)])
def test_model_following_bends_as_on_the_independent_plant(wrong, cell, error):
    dead_time_ms, lag_ms, hz = cell
    believed = {
        "lag": 1e-3 * lag_ms * (1.0 + error[0]),
        "dead_time": 1e-3 * dead_time_ms * (1.0 + error[1]),
    }
    flown = wrong[(*cell, error[0], error[1] if dead_time_ms else 0.0)]
    assert flown == pytest.approx(
        judged("model-following", dead_time_ms, lag_ms, hz, **believed), rel=0.02
    )


def test_with_the_right_times_it_is_far_the_straightest_everywhere(right):
    for method, cell in right:
        if method == "model-following":
            assert right[method, cell] <= (0.0012 if cell[2] < 250 else 0.0006)
            assert right[method, cell] <= 0.2 * best_other(right, cell)


def test_with_wrong_times_it_is_still_the_straightest_in_every_cell(right, wrong):
    for (*cell, _, _), bent in wrong.items():
        assert bent < best_other(right, tuple(cell))


def test_the_table_of_the_grid_sets_the_worst_beside_the_best_other(out, right, wrong):
    for row in rows(out, "lag-worst-knowledge"):
        hz, lag = (float(word.split()[0]) for word in row["rate, lag"].split(","))
        for dead_time in DEAD_TIMES:
            cell = (dead_time, lag, hz)
            bent = max(value for place, value in wrong.items() if place[:3] == cell)
            assert float(row[f"worst, {dead_time} ms"]) == bent
            assert float(row[f"best other, {dead_time} ms"]) == best_other(right, cell)


@pytest.mark.parametrize(("hz", "most"), [("100", 0.0012), ("250", 0.0006)])
def test_the_case_in_full_is_as_straight_as_asked(out, hz, most):
    table = {(row["method"], row["rate, Hz"]): row for row in rows(out, "lag")}
    assert across(table["model-following", hz]) <= most
    limited = table["model-following, W_M = π/2", hz]
    assert across(limited) <= 0.001
    assert float(limited["largest √(ω_x²+ω_y²), rad/s"]) <= 1.03 * np.pi / 2
    assert across(table["first-order", hz]) == pytest.approx(0.031, rel=0.1)
    assert across(table["quaternion", hz]) == pytest.approx(0.024, rel=0.1)


def test_the_case_in_full_is_straight_with_lag_too_long_and_dead_time_too_short(out):
    table = {row["lag"]: row for row in rows(out, "lag-wrong-knowledge")}
    assert list(table) == ["−50 %", "−30 %", "right", "+30 %", "+50 %"]
    assert float(table["+50 %"]["dead time −30 %"]) <= 0.002
    assert float(table["right"]["dead time right"]) <= 0.0012


def test_the_complete_inner_loop_leaves_model_following_straight_and_of_second_order(out):
    table = {row["method"]: row for row in rows(out, "lag-inner-loop")}
    following = table["model-following"]
    assert across(following) <= 0.3 * across(table["first-order"])
    assert across(following) <= 0.5 * across(table["quaternion"])
    best = min(float(table[name]["largest deviation from this model"]) for name in OTHERS)
    assert float(following["largest deviation from this model"]) <= 0.5 * best


@pytest.mark.parametrize("hz", ["50 Hz", "100 Hz", "250 Hz"])
def test_with_the_complete_inner_loop_it_is_straightest_at_every_rate(out, hz):
    table = {row["method"]: float(row[hz]) for row in rows(out, "lag-inner-loop-rates")}
    best = min(table[name] for name in OTHERS)
    assert table["model-following"] < 0.25 * best
    assert (
        table["model-following"]
        < table["model-following, lag and dead time wrong by the worst error"]
        < 0.8 * best
    )
    beliefs = rows(out, "lag-inner-loop-beliefs")
    flown = [across(row) for row in beliefs if float(row["rate, Hz"]) == float(hz.split()[0])]
    assert len(flown) == 25
    assert max(flown) == table["model-following, lag and dead time wrong by the worst error"]


def test_the_page_says_where_wrong_knowledge_is_worse_than_another_method(out, right, wrong):
    ratios = {}
    for (*place, lag, dead_time), bent in wrong.items():
        cell = tuple(place)
        ratio = bent / best_other(right, cell)
        ratios[cell] = max(ratios.get(cell, (0.0,)), (ratio, lag, dead_time))
    text = (out / "lag.html").read_text()
    worse = sum(ratio >= 1.0 for ratio, _, _ in ratios.values())
    assert f"Worse than the best other method in {worse} of 12 cells" in text
    last = max(ratios, key=ratios.get)
    assert "dead time {:.0f} ms, lag {:.0f} ms, {:.0f} Hz".format(*last) in text
    assert ratios[last][1:] == (-0.5, -0.5)
    assert "with lag −50 % and dead time −50 %" in text
