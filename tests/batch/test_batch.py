"""Batches against the flight's own planners, and against rotations of SciPy."""

import math
import os
import platform
import subprocess
import sys
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from companion import batch
from companion.attitude import (
    LAW_NAMES,
    InvalidPeriodError,
    InvalidQuaternionError,
    InvalidTargetError,
    Limits,
    make_planner,
)
from companion.batch.loops import compiled_loops
from companion.extras import MissingExtraError
from tests.batch.fleet import LIMITS, anywhere, in_flight

COMPILED = pytest.param(
    True, marks=pytest.mark.skipif(not batch.can_compile(), reason="needs numba"), id="compiled"
)
BOTH = pytest.mark.parametrize("compiled", [COMPILED, pytest.param(False, id="plain")])
DT = 0.004
FIRST_ORDER = make_planner("first-order")


@cache
def flown_anywhere(name, limits):
    """What flights answer at 3000 places, which compiled and plain batches must give."""
    return in_flight(name, limits, *anywhere(3000), DT)


def rounding(name, q):
    """How much a law enlarges the rounding of its input."""
    if name == "exact":
        return 1.0 / DT  # an angle, rounded as angles are, divided by the sample period
    if name == "euler":
        w, x, y, z = q
        return 1.0 / np.sqrt(1.0 - (2.0 * (w * y - z * x)) ** 2)  # 1/cos(pitch)
    return 1.0


@pytest.mark.parametrize("name", LAW_NAMES)
@pytest.mark.parametrize("limits", LIMITS)
@BOTH
def test_rates_are_those_of_the_flight(name, limits, compiled):
    q, targets = anywhere(3000)
    flown = flown_anywhere(name, limits)
    rates = batch.rates(make_planner(name, limits=limits), q, targets, DT, compiled)
    bound = 1e-13 * np.maximum(1.0, np.abs(flown)) * rounding(name, q) if compiled else 0.0
    assert np.all(np.abs(rates - flown) <= bound)


@pytest.mark.parametrize("name", LAW_NAMES)
@BOTH
def test_each_attitude_is_the_one_before_turned_by_the_rates(name, compiled):
    q, targets = anywhere(20)
    steps = 30
    planner = make_planner(name, limits=Limits(max_tilt_rate=20.0, max_yaw_rate=20.0))
    history = batch.simulate(planner, q, targets, 0.02, steps, compiled)
    assert history.q.shape == (steps + 1, 4, 20)
    assert history.rates.shape == (steps, 3, 20)
    assert np.abs(history.q[0] - q).max() <= 1e-15
    for k in range(steps):
        flown = in_flight(
            name, Limits(max_tilt_rate=20.0, max_yaw_rate=20.0), history.q[k], targets, 0.02
        )
        assert np.abs(history.rates[k] - flown).max() <= 2e-12
        before = Rotation.from_quat(history.q[k].T, scalar_first=True)
        after = before * Rotation.from_rotvec(0.02 * history.rates[k].T)
        off = after.inv() * Rotation.from_quat(history.q[k + 1].T, scalar_first=True)
        assert off.magnitude().max() <= 1e-14


@pytest.mark.parametrize("count", [0, 1, 7, 336, 337, 1000])
@pytest.mark.parametrize("steps", [0, 1, 2, 5])
def test_advance_ends_where_simulate_does(count, steps):
    q, targets = anywhere(count)
    compiled = batch.can_compile()
    end = batch.advance(FIRST_ORDER, q, targets, DT, steps, compiled)
    assert end.shape == (4, count)
    there = batch.simulate(FIRST_ORDER, q, targets, DT, steps, compiled).q[-1]
    assert np.abs(end - there).max(initial=0.0) <= 1e-14
    assert np.shares_memory(end, q) is False


@BOTH
def test_advance_arrives(compiled):
    """All of them upright, at the wanted coefficients, after ten time constants."""
    q, targets = anywhere(50)
    w, x, y, z = batch.advance(FIRST_ORDER, q, targets, DT, 1000, compiled)
    north, east, up = -2 * (x * z + w * y), -2 * (y * z - w * x), 1 - 2 * (x * x + y * y)
    assert up.min() > 0.7
    assert np.abs([north - targets[0], east - targets[1]]).max() < 1e-4


@pytest.mark.parametrize(
    ("norm", "turns", "longest"), [(1.0009, 0, 0.5), (0.9991, 0, 0.5), (1.0, 3, 0.5), (1.0, 0, 0.9)]
)
@BOTH
def test_what_a_planner_would_correct_is_corrected(norm, turns, longest, compiled):
    q, targets = anywhere(40, longest=longest)
    q[:, 7] *= norm
    targets[2, 8] += turns * 2 * math.pi
    limits = Limits(math.radians(40))
    given = q.copy(), targets.copy()
    rates = batch.rates(make_planner("first-order", limits=limits), q, targets, DT, compiled)
    assert np.abs(rates - in_flight("first-order", limits, q, targets, DT)).max() < 1e-13
    assert np.array_equal(q, given[0])
    assert np.array_equal(targets, given[1])


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e200, 0.9])
@pytest.mark.parametrize("row", range(4))
@BOTH
def test_a_bad_quaternion_is_refused_by_its_number(row, bad, compiled):
    q, targets = anywhere(9)
    q[:, 4] = 0.5
    q[row, 4] = bad
    for call in (batch.advance, batch.simulate):
        with pytest.raises(InvalidQuaternionError, match="vehicle 4"):
            call(FIRST_ORDER, q, targets, DT, 3, compiled)
    with pytest.raises(InvalidQuaternionError, match=r"vehicle 4: attitude quaternion .* norm"):
        batch.rates(FIRST_ORDER, q, targets, DT, compiled)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("row", range(4))
@BOTH
def test_a_bad_target_is_refused_by_its_number(row, bad, compiled):
    q, targets = anywhere(9)
    targets[row, 4] = bad
    with pytest.raises(InvalidTargetError, match="vehicle 4: target is not finite"):
        batch.rates(FIRST_ORDER, q, targets, DT, compiled)


def test_shapes_and_steps_that_do_not_fit_are_refused():
    q, targets = anywhere(9)
    with pytest.raises(ValueError, match=r"q must have the shape \(4, n\), not \(9, 4\)"):
        batch.rates(FIRST_ORDER, q.T, targets, DT)
    with pytest.raises(ValueError, match=r"targets must have the shape \(4, n\), not \(4,\)"):
        batch.rates(FIRST_ORDER, q, targets[:, 0], DT)
    with pytest.raises(ValueError, match="9 attitudes, but 8 targets"):
        batch.rates(FIRST_ORDER, q, targets[:, :8], DT)
    with pytest.raises(ValueError, match="steps must not be negative"):
        batch.advance(FIRST_ORDER, q, targets, DT, -1)


@pytest.mark.parametrize("turn", [0.9, 1.1, 7.0, 1e4])
@BOTH
def test_turns_of_any_size_are_right(turn, compiled):
    """A heading rate fed forward that the series for small turns cannot follow, on one of many."""
    q, targets = anywhere(50)
    targets[3, 17] = turn / DT
    planner = make_planner("so3")
    history = batch.simulate(planner, q, targets, DT, 2, compiled)
    after = Rotation.from_quat(q.T, scalar_first=True)
    for rates in history.rates:
        after = after * Rotation.from_rotvec(DT * rates.T)
    off = after.inv() * Rotation.from_quat(history.q[-1].T, scalar_first=True)
    assert off.magnitude().max() <= 1e-15 * max(10.0, 2.0 * turn)
    end = batch.advance(planner, q, targets, DT, 2, compiled)
    assert np.abs(end - history.q[-1]).max() <= 1e-15 * max(10.0, 2.0 * turn)


def test_only_large_work_is_compiled(monkeypatch):
    used = []
    monkeypatch.setattr(
        "companion.batch.batch.compiled_loops", lambda law: used.append(law) or compiled_loops(law)
    )
    q, targets = anywhere(5)
    batch.advance(FIRST_ORDER, q, targets, DT, 19)
    assert used == []
    monkeypatch.setattr("companion.batch.batch.MIN_STEPS_TO_COMPILE", 100)
    batch.advance(FIRST_ORDER, q, targets, DT, 19)
    assert used == []
    batch.advance(FIRST_ORDER, q, targets, DT, 20)
    assert len(used) == (1 if batch.can_compile() else 0)


def test_without_numba_it_works_and_says_what_is_missing(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    monkeypatch.setattr("companion.batch.batch.MIN_STEPS_TO_COMPILE", 0)
    q, targets = anywhere(5)
    assert not batch.can_compile()
    flown = in_flight("first-order", Limits(), q, targets, DT)
    assert np.array_equal(batch.rates(FIRST_ORDER, q, targets, DT), flown)
    with pytest.raises(MissingExtraError, match=r"a compiled batch needs numba.*\[study\]"):
        batch.rates(FIRST_ORDER, q, targets, DT, compiled=True)


def test_numba_is_not_imported_before_it_is_used():
    code = "import sys, companion.batch, companion.cli; raise SystemExit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.skipif(not batch.can_compile(), reason="needs numba")
@pytest.mark.skipif(platform.machine() != "x86_64", reason="knows the words of x86 only")
@pytest.mark.skipif("NUMBA_DISABLE_JIT" in os.environ, reason="nothing is compiled")
def test_the_loop_over_first_order_is_vectorised():
    """Losing this costs a factor of five and changes no result, so nothing else would tell."""
    q, targets = anywhere(8)
    batch.rates(FIRST_ORDER, q, targets, DT, compiled=True)
    (code,) = compiled_loops(FIRST_ORDER.law).apply_law.inspect_asm().values()
    assert "divpd" in code
    assert "sqrtpd" in code
    assert "atan" not in code


def test_a_planner_with_memory_is_refused_in_a_sentence():
    planner = make_planner("model-following", lag=0.047, dead_time=0.04)
    level, ahead = [[1.0], [0.0], [0.0], [0.0]], [[0.2], [0.0], [0.0], [0.0]]
    words = r"without memory, made by make_planner \(first-order, .* one planner for each"
    with pytest.raises(TypeError, match=words):
        batch.rates(planner, level, ahead, DT)
    with pytest.raises(TypeError, match=words):
        batch.advance(planner, level, ahead, DT, 3)
    with pytest.raises(TypeError, match=words):
        batch.simulate(planner, level, ahead, DT, 3)


@pytest.mark.parametrize("dt", [0.0, -0.004, math.nan, math.inf])
@pytest.mark.parametrize("call", [batch.rates, batch.advance, batch.simulate])
def test_a_period_that_is_not_positive_and_finite_is_refused(call, dt):
    steps = () if call is batch.rates else (3,)
    planner = make_planner("first-order")
    with pytest.raises(InvalidPeriodError, match="dt must be positive"):
        call(planner, [[1.0], [0.0], [0.0], [0.0]], np.zeros((4, 1)), dt, *steps)


@pytest.mark.parametrize("steps", [2.0, "2", None])
def test_steps_are_an_integer(steps):
    planner = make_planner("first-order")
    with pytest.raises(TypeError, match="integer"):
        batch.advance(planner, [[1.0], [0.0], [0.0], [0.0]], np.zeros((4, 1)), 0.01, steps)


@pytest.mark.parametrize("shape", [(4,), (7, 4), (3, 7), (2, 3, 7)])
def test_coefficients_of_another_shape_are_refused(shape):
    with pytest.raises(ValueError, match=r"shape \(\.\.\., 4, n\), not"):
        batch.coefficients(np.zeros(shape))


def law_with_a_closure(factor):
    def law(q, target, dt, constants):
        return factor, 0.0, 0.0

    return law


class CallableLaw:
    def __call__(self, q, target, dt, constants):
        return 1.0, 0.0, 0.0


def law_with_a_default(q, target, dt, constants, factor=1.0):
    return factor, 0.0, 0.0


@pytest.mark.parametrize("law", [law_with_a_closure(1.0), CallableLaw(), law_with_a_default])
def test_a_law_that_cannot_be_compiled_is_named_and_is_mapped_in_python(law):
    q, planner = [[1.0], [0.0], [0.0], [0.0]], make_planner(law)
    assert batch.rates(planner, q, np.zeros((4, 1)), 0.01, compiled=False)[0] == 1.0
    with pytest.raises(TypeError, match=r"cannot be compiled.*compiled=False"):
        batch.rates(planner, q, np.zeros((4, 1)), 0.01, compiled=True)


def test_a_large_batch_maps_a_law_that_cannot_be_compiled_in_python(monkeypatch):
    monkeypatch.setattr("companion.batch.batch.MIN_STEPS_TO_COMPILE", 1)
    planner = make_planner(law_with_a_closure(1.0))
    assert batch.rates(planner, [[1.0], [0.0], [0.0], [0.0]], np.zeros((4, 1)), 0.01)[0] == 1.0
