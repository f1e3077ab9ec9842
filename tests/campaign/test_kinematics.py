"""Batch kinematics: one vehicle behind its rate loop, its figures, and the rows of a campaign."""

import json
from dataclasses import replace
from math import radians

import numpy as np
import pytest

from companion.attitude import (
    BodyRates,
    Coefficients,
    Limits,
    Target,
    attitude,
    coefficients,
    make_planner,
)
from companion.attitude.rate_response import AxisResponse
from companion.attitude.reference import Lag
from companion.attitude.rotation import after_constant_rates, clamp
from companion.batch.rate_loop import fly_steps
from companion.batch.step_figures import step_figures
from companion.campaign import engine, loading, store, unit
from companion.campaign.case import Fault
from companion.campaign.kinematics import check_case
from companion.campaign.versions import versions
from companion.files.yaml_file import ConfigError
from companion.recording.measurements.response import measure_response

HEADING, GAIN, EVERY = 0.7, 4.0, 4
TILT = AxisResponse(0.047, 0.040)
LOOPS = {
    "first order": (TILT, TILT, AxisResponse(0.37, 0.102)),
    "second order, slewing": (
        AxisResponse(0.05, 0.0, acceleration=8.0, damping=0.7),
        AxisResponse(0.03, 0.0154, acceleration=9.0),
        AxisResponse(0.0558, 0.143, acceleration=4.7),
    ),
}


@pytest.fixture(scope="module")
def planner():
    limits = Limits(radians(35), radians(90), radians(60))
    return make_planner("first-order", gain=GAIN, limits=limits)


@pytest.fixture(scope="module")
def targets():
    """Two corners of 0.6 s and a step north, at 250 Hz."""
    wanted = np.repeat([[0.2, 0.3], [-0.2, 0.3], [0.1, 0.0]], 150, axis=0)
    return np.column_stack([wanted, np.full(450, HEADING), np.zeros(450)])


def in_python(planner, axes, q, targets):
    """The same with the objects of a flight: planner, `Lag`, dead time in a list."""
    lags = [Lag(max(axis.lag, 1e-3), axis.sigma) for axis in axes]
    sent, aims, state, path, commanded = [], [0.0] * 3, [(0.0, 0.0)] * 3, [], []
    for target in targets:
        path.append(coefficients(q))
        rates = planner.rates(q, Target(*target), EVERY / 1000)
        commanded.append(rates)
        for _ in range(EVERY):
            sent.append(rates)
            mean = []
            for axis, (response, lag) in enumerate(zip(axes, lags, strict=True)):
                then = len(sent) - 1 - round(1000 * response.dead_time)
                acting = sent[then][axis] if then >= 0 else 0.0
                aims[axis] += clamp(acting - aims[axis], response.acceleration / 1000)
                moved, *state[axis] = lag.after(*state[axis], aims[axis], 0.001)
                mean.append(1000 * moved)
            q = after_constant_rates(q, BodyRates(*mean), 0.001)
    return np.array(path), np.array(commanded), q


@pytest.mark.parametrize("name", LOOPS)
def test_it_flies_as_the_planner_and_the_lags_do_in_python(planner, targets, name):
    start = attitude(Coefficients(0.0, 0.0), HEADING)
    path, commanded, end = in_python(planner, LOOPS[name], start, targets)
    flight = fly_steps(planner, LOOPS[name], start, targets, EVERY)
    assert np.abs(path).max() > 0.25
    assert flight.coefficients == pytest.approx(path, abs=1e-10)
    assert flight.commanded_rates == pytest.approx(commanded, abs=1e-9)
    assert flight.q == pytest.approx(end, abs=1e-10)


def test_its_figures_are_those_that_a_flight_measures(planner, targets):
    start = attitude(Coefficients(0.0, 0.0), HEADING)
    flight = fly_steps(planner, LOOPS["first order"], start, targets, EVERY)
    figures = step_figures(flight, GAIN, EVERY / 1000)
    attitudes = [attitude(Coefficients(*c), HEADING) for c in flight.coefficients.tolist()]
    time = np.arange(len(targets)) * EVERY / 1000
    measured = measure_response(np.column_stack([time, attitudes, flight.targets]), GAIN)
    assert figures.cross_axis_max == pytest.approx(measured.cross_axis_max, rel=1e-9)
    assert figures.model_deviation_max == pytest.approx(measured.model_deviation_max, rel=1e-9)
    assert figures.time_constant_north == pytest.approx(measured.time_constant_north_s, rel=1e-3)
    assert figures.time_constant_east == pytest.approx(measured.time_constant_east_s, rel=1e-3)
    tilt_rates = np.hypot(flight.commanded_rates[:, 0], flight.commanded_rates[:, 1])
    assert figures.rate_max == pytest.approx(tilt_rates.max())
    assert figures.rate_rms == pytest.approx(np.sqrt(np.mean(tilt_rates**2)))


def test_an_axis_without_a_step_has_no_time_constant(planner, targets):
    north_only = targets * [1.0, 0.0, 1.0, 1.0]
    axes = [replace(axis, lag=0.0, dead_time=0.0) for axis in LOOPS["first order"]]
    start = attitude(Coefficients(0.0, 0.0), HEADING)
    figures = step_figures(fly_steps(planner, axes, start, north_only, EVERY), GAIN, EVERY / 1000)
    assert np.isnan(figures.time_constant_east)
    assert figures.time_constant_north == pytest.approx(1.0 / GAIN, rel=0.05)


BATCH = {
    "name": "steps",
    "kind": "batch",
    "config": {"planner": {"name": "first-order"}, "vehicle": {"lag_ms": 40, "dead_time_ms": 30}},
    "samples": 3,
    "set": {"flight.maneuvers": ["corners"], "corners.duration_s": 0.4},
    "sweep": {
        "vehicle.lag_ms": [5, 80],
        "corners.north_coefficient": {"uniform": [0.1, 0.35]},
        "mock.home.heading_deg": {"uniform": [-180, 180]},
    },
}


def campaign(folder, **changes):
    path = folder / "steps.yaml"
    path.write_text(json.dumps(BATCH | changes))
    return loading.load(path)


def test_each_case_of_a_batch_is_flown_with_its_own_vehicle_and_target(tmp_path):
    told = campaign(tmp_path)
    cases = list(told.cases())
    rows = unit.run_cases("batch", cases)
    assert [row["case"] for row in rows] == list(range(6))
    assert len({row["digest"] for row in rows}) == 6
    assert rows == unit.run_cases("batch", cases)
    for quick, slow in zip(rows[::2], rows[1::2], strict=True):
        assert quick["corners.north_coefficient"] == slow["corners.north_coefficient"]
        assert quick["time_constant_s"] < slow["time_constant_s"] - 0.02
        assert quick["cross_axis_max"] < slow["cross_axis_max"]
    assert {row["result"] for row in rows} <= {"ok", "not straight"}
    assert all(row["ok"] == (row["result"] == "ok") for row in rows)
    stored = store.table(told.file, rows).to_pylist()
    assert [row["result"] for row in stored] == [row["result"] for row in rows]


@pytest.mark.parametrize(
    ("told", "message"),
    [
        ({"planner.name": "model-following"}, "without memory"),
        ({"flight.maneuvers": ["hover"]}, r"\[corners\] or \[steps\]"),
        ({"link.attitude_rate_hz": 300.0}, "divides 1000, not 300"),
    ],
)
def test_what_a_batch_cannot_fly_is_refused(tmp_path, told, message):
    (case, *_) = campaign(tmp_path, set=BATCH["set"] | told).cases()
    with pytest.raises(ConfigError, match=message):
        check_case(case)


def test_a_batch_is_flown_at_once_and_has_one_time(tmp_path):
    cases = list(campaign(tmp_path).cases())
    flown = unit.fly_cases("batch", cases, versions())
    assert flown.rows == unit.run_cases("batch", cases)
    assert len(flown.wall_s) == 1
    assert flown.worker == "this process"
    unit.check_cases("batch", cases)
    (hover, *_) = campaign(tmp_path, set={"flight.maneuvers": ["hover"]}, sweep={}).cases()
    unit.check_cases("flights", [hover])
    with pytest.raises(ConfigError, match=r"case 0: .*set flight.maneuvers to \[corners\]"):
        unit.check_cases("batch", [*cases, hover])
    assert engine.internal_errors(tmp_path, campaign(tmp_path).file) == {}


def test_steps_are_flown_to_both_sides_in_both_axes(tmp_path):
    told = {"flight.maneuvers": ["steps"], "steps.duration_s": 0.4}
    made = campaign(tmp_path, set=told, sweep={"steps.coefficient": [0.02, 0.04]}, samples=1)
    small, large = unit.run_cases("batch", list(made.cases()))
    assert small["ok"]
    assert small["time_constant_s"] == pytest.approx(large["time_constant_s"], rel=0.05)
    assert large["rate_max_rad_s"] == pytest.approx(2.0 * small["rate_max_rad_s"], rel=0.1)


def test_a_fault_is_no_part_of_a_batch(tmp_path):
    case = replace(next(campaign(tmp_path).cases()), fault=Fault("x", (), "land", 0.0, ("ok",)))
    with pytest.raises(ConfigError, match=r"kind: batch has no faults"):
        check_case(case)
