"""Figure 4: the step within the rate limit, and the reference of equation 33."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from companion.attitude import Coefficients, Limits, Target, make_planner
from companion.attitude.reference import FirstOrderReference
from tests.attitude.independent import LAWS, attitudes, continuous, sampled
from tests.attitude.simulate import fly_all

START, GOAL = np.array([-0.5, 0.0]), np.array([0.0, 0.5])
DISTANCE = np.hypot(*(GOAL - START))
HEADINGS = np.arange(-3, 5) * np.pi / 4
GAIN = 5.0
W_M = np.pi / 2
MAX_TILT = np.radians(40.0)
MAX_SPEED = W_M * np.cos(MAX_TILT)
SECONDS = 1.2
PERIOD = 1e-3


def fly_planner(name, shape, dt=PERIOD):
    limits = Limits(MAX_TILT, W_M, shape=shape)
    targets = [Target(*GOAL, psi) for psi in HEADINGS]
    return fly_all(
        make_planner(name, GAIN, limits=limits), attitudes(START, HEADINGS), targets, SECONDS, dt
    )


def own_law(name, shape):
    goal = attitudes(GOAL, HEADINGS)
    if shape == "paper":
        return lambda r: LAWS[name](r, goal, GAIN, W_M, max_speed=MAX_SPEED)
    return lambda r: LAWS[name](r, goal, GAIN, W_M)


def distances(path):
    return np.linalg.norm(path - GOAL, axis=-1)


def arrivals(path, dt):
    """When each flight first has 5 % of the way left, s."""
    t = np.arange(len(path)) * dt
    return np.array([np.interp(-0.05 * DISTANCE, -left, t) for left in distances(path).T])


CASES = [
    ("first-order", "paper", 1.30, 0.771),
    ("first-order", "tight", 1.571, 0.692),
    ("so3", "tight", 1.571, 0.685),
]


@pytest.mark.parametrize(("name", "shape", "peak", "seconds"), CASES)
def test_figure_4(name, shape, peak, seconds):
    path, rates = fly_planner(name, shape)
    judge, judge_rates = sampled(own_law(name, shape), attitudes(START, HEADINGS), SECONDS, PERIOD)
    assert np.abs(path - judge).max() < 1e-11
    for w in (rates, judge_rates):
        largest = np.hypot(w[..., 0], w[..., 1]).max(axis=0)
        assert largest == pytest.approx(np.full(8, peak), rel=0.02)
        assert largest.max() <= W_M * (1.0 + 1e-12)
    for flown, step in (
        (path, PERIOD),
        (judge, PERIOD),
        (continuous(own_law(name, shape), attitudes(START, HEADINGS), SECONDS, 4e-3), 4e-3),
    ):
        assert arrivals(flown, step) == pytest.approx(np.full(8, seconds), rel=0.02)


@pytest.mark.parametrize("shape", ["paper", "tight"])
def test_the_limit_leaves_the_line_straight(shape):
    def across(path):
        return np.abs(path[..., 0] - path[..., 1] + 0.5).max() / np.sqrt(2.0)

    assert across(fly_planner("first-order", shape)[0]) < 5e-4
    start = attitudes(START, HEADINGS)
    # In continuous time it is straight but for the kink where the limit ends, within a step.
    assert across(continuous(own_law("first-order", shape), start, SECONDS, 4e-3)) < 1e-7
    assert across(fly_planner("exact", shape, 0.01)[0]) < 1e-12


def integrated(t):
    """The model of equation 33 by SciPy: the distance left at times `t`."""
    # Its slope has a kink where the limit ends: steps are kept short instead of trusted.
    solution = solve_ivp(
        lambda _, d: -np.minimum(GAIN * d, MAX_SPEED),
        (0.0, t[-1]),
        [DISTANCE],
        t_eval=t,
        rtol=1e-11,
        atol=1e-13,
        max_step=1e-3,
    )
    return solution.y[0]


def test_the_reference_with_the_limit_of_equation_33():
    t = np.linspace(0.0, 1.2, 121)
    model = FirstOrderReference(GAIN, max_speed=MAX_SPEED)
    c = Coefficients(*START)
    at_once = np.array([model.after(c, Coefficients(*GOAL), float(s)) for s in t])
    assert distances(at_once) == pytest.approx(integrated(t), abs=1e-8)
    assert np.abs(at_once[:, 0] - at_once[:, 1] + 0.5).max() < 1e-15
    stepwise = [c]
    for _ in t[1:]:
        stepwise.append(model.after(stepwise[-1], Coefficients(*GOAL), 0.01))
    assert np.array(stepwise) == pytest.approx(at_once, abs=1e-14)


def test_the_planner_in_the_shape_of_the_paper_follows_that_reference():
    """The paper's planner but for the sampling; `exact` at a tenth of the rate, to the last bit."""
    t = np.arange(round(SECONDS / PERIOD) + 1) * PERIOD
    path, _ = fly_planner("first-order", "paper")
    assert np.abs(distances(path) - integrated(t)[:, None]).max() < 1e-3
    path, _ = fly_planner("exact", "paper", 10 * PERIOD)
    assert np.abs(distances(path) - integrated(t[::10])[:, None]).max() < 1e-8
    model = FirstOrderReference(GAIN, max_speed=MAX_SPEED)
    for step, c in enumerate(path):
        expected = model.after(Coefficients(*START), Coefficients(*GOAL), step * 10 * PERIOD)
        assert np.abs(c - np.array(expected)).max() <= 1e-12


def test_the_tight_limit_is_faster_than_the_papers_and_uses_the_whole_rate():
    tight, rates = fly_planner("first-order", "tight")
    paper, _ = fly_planner("first-order", "paper")
    assert (arrivals(tight, PERIOD) < arrivals(paper, PERIOD) - 0.05).all()
    used = np.hypot(rates[..., 0], rates[..., 1])
    limited = GAIN * distances(tight[:-1]) > W_M  # cos(tilt) ≤ 1: there it must be at its limit
    assert limited.any()
    assert np.abs(used[limited] - W_M).max() < 1e-12
