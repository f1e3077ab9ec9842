"""Every planner, step by step, against the paper's formulas on SciPy rotations."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from companion.attitude import Limits, Target, make_planner
from tests.attitude import independent
from tests.attitude.independent import LAWS, attitudes, coefficients_of, headings_of
from tests.attitude.simulate import answers

COUNT = 3000
W_M = np.pi / 2


def random_attitudes(rng, max_tilt):
    """Uniform over the cap of the sphere and over all headings."""
    tilt = np.arccos(rng.uniform(np.cos(max_tilt), 1.0, COUNT))
    bearing = rng.uniform(-np.pi, np.pi, COUNT)
    direction = np.column_stack([np.cos(bearing), np.sin(bearing)])
    return attitudes(np.sin(tilt)[:, None] * direction, rng.uniform(-np.pi, np.pi, COUNT))


@pytest.fixture(scope="module")
def cases():
    """Attitudes up to 74.5° of tilt, quaternions of both signs, and targets for them."""
    rng = np.random.default_rng(2727)
    r = random_attitudes(rng, np.radians(74.5))
    goal = random_attitudes(rng, np.radians(74.5))
    signs = rng.choice([-1.0, 1.0], COUNT)
    return Rotation.from_quat(r.as_quat() * signs[:, None]), goal, targets_at(goal)


def targets_at(goal):
    values = np.column_stack([coefficients_of(goal), headings_of(goal)])
    return [Target(*row) for row in values.tolist()]


@pytest.mark.parametrize(("tilt_rate", "yaw_rate"), [(None, None), (W_M, 0.7), (W_M, None)])
@pytest.mark.parametrize("name", LAWS)
def test_rates_are_those_of_the_paper(name, tilt_rate, yaw_rate, cases):
    r, goal, targets = cases
    limits = Limits(max_tilt_rate=tilt_rate, max_yaw_rate=yaw_rate)
    rates = answers(make_planner(name, 5.0, limits=limits), r, targets, 0.01)
    expected = LAWS[name](r, goal, 5.0, tilt_rate or np.inf, yaw_rate or np.inf)
    assert np.abs(rates - expected).max() <= 1e-12
    if tilt_rate:
        limited = np.hypot(rates[:, 0], rates[:, 1]) > tilt_rate * (1.0 - 1e-12)
        assert 0.3 < limited.mean() < 1.0  # the cases try both sides of the limit


def test_rates_in_the_shape_of_the_paper(cases):
    """Equation 33 beside the limit itself, which still holds beyond the largest tilt."""
    r, goal, targets = cases
    limits = Limits(np.radians(74.9), W_M, shape="paper")
    rates = answers(make_planner("first-order", 5.0, limits=limits), r, targets, 0.01)
    expected = LAWS["first-order"](r, goal, 5.0, W_M, max_speed=W_M * np.cos(np.radians(74.9)))
    assert np.abs(rates - expected).max() <= 1e-12


@pytest.mark.parametrize("dt", [1e-3, 0.01, 0.02, 0.1, 0.5])
def test_exact_is_the_rotation_onto_the_model(dt, cases):
    r, goal, targets = cases
    rates = answers(make_planner("exact", 5.0, yaw_gain=3.0), r, targets, dt)
    expected = independent.exact(r, goal, 5.0, dt, yaw_gain=3.0)
    assert np.abs(rates - expected).max() * dt <= 1e-13


@pytest.mark.parametrize("limits", [Limits(), Limits(np.radians(40), W_M, 0.9)])
@pytest.mark.parametrize("name", ["first-order", "exact", "quaternion", "so3", "euler"])
def test_in_the_world_only_eulers_answer_depends_on_the_heading(name, limits, cases):
    """A body turned about its own z axis, its target too: the same rates, seen from that body."""
    r, goal, targets = cases
    planner = make_planner(name, limits=limits)
    rates = answers(planner, r, targets, 0.01)
    apart = []
    for psi in (1.0, -2.0, 3.0):
        turn = Rotation.from_rotvec([0.0, 0.0, psi])
        turned = answers(planner, r * turn, targets_at(goal * turn), 0.01)
        apart.append(turn.apply(turned) - rates)
    largest = np.abs(apart).max()
    if name == "euler":
        assert largest > 0.1
    else:
        assert largest < 1e-9


@pytest.mark.parametrize("name", LAWS)
def test_heading_rate_is_fed_forward_onto_the_yaw_rate(name, cases):
    r, _, targets = cases
    planner = make_planner(name)
    moving = [target._replace(heading_rate=0.4) for target in targets]
    added = answers(planner, r, moving, 0.01) - answers(planner, r, targets, 0.01)
    assert np.abs(added - [0.0, 0.0, 0.4]).max() <= 1e-12
