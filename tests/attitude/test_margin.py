"""The largest stable gain against the rightmost root of the delayed loop itself."""

import math

import numpy as np
import pytest

from companion.attitude import Target, make_planner
from companion.attitude.rate_response import AxisResponse, feedback_gain, largest_gain

NODES = 24


def rightmost(gain, lag, dead_time):
    """Largest real part of the roots of τs² + s + k·e^(−θs) = 0, 1/s.

    They are the eigenvalues of d/dt on the states x(t − θ…t), here polynomials at Chebyshev nodes,
    with ẋ = v, τ·v̇ = −v − k·x(t − θ) at the newest.
    """
    n = np.arange(NODES + 1)
    x = np.cos(np.pi * n / NODES)  # 1 is now, −1 one dead time ago
    weight = np.where((n == 0) | (n == NODES), 2.0, 1.0) * (-1.0) ** n
    d = np.outer(weight, 1.0 / weight) / (x[:, None] - x + np.eye(NODES + 1))
    d -= np.diag(d.sum(axis=1))
    system = np.kron(d * 2.0 / dead_time, np.eye(2))
    system[:2] = 0.0
    system[0, 1] = 1.0
    system[1, 1] = -1.0 / lag
    system[1, -2] = -gain / lag
    return np.linalg.eigvals(system).real.max()


@pytest.mark.parametrize("lag", [0.003, 0.01, 0.025, 0.06, 0.3, 1.0])
@pytest.mark.parametrize("dead_time", [0.002, 0.005, 0.02, 0.045, 0.08, 0.17, 1.0])
def test_stable_just_below_and_not_just_above(lag, dead_time):
    gain = largest_gain(lag, dead_time)
    scale = lag + dead_time
    assert rightmost(0.99 * gain, lag, dead_time) * scale < -1e-6
    assert rightmost(1.01 * gain, lag, dead_time) * scale > 1e-6


def test_of_second_order_it_is_that_of_its_two_lags_and_of_a_ring_less():
    """(τ₁s + 1)(τ₂s + 1) behind no dead time bears 1/τ₁ + 1/τ₂ (Hurwitz); so does any ζ, 2ζω."""
    assert largest_gain(0.05, 0.0, 0.02 * 0.03) == pytest.approx(1.0 / 0.02 + 1.0 / 0.03, rel=1e-9)
    assert largest_gain(2 * 0.4 / 20.0, 0.0, 1 / 400.0) == pytest.approx(2 * 0.4 * 20.0, rel=1e-9)
    assert largest_gain(0.05, 0.04, 1e-9) == pytest.approx(largest_gain(0.05, 0.04), rel=1e-5)


def test_without_a_lag_it_is_a_quarter_turn_in_the_dead_time():
    assert largest_gain(0.0, 0.045) == pytest.approx(0.5 * math.pi / 0.045, rel=1e-12)


def test_without_a_dead_time_every_gain_is_stable():
    assert largest_gain(0.025, 0.0) == math.inf
    assert largest_gain(0.0, 0.0) == math.inf


def test_a_short_dead_time_of_a_long_lag_bears_its_inverse():
    """ω → 1/√(τθ), k → ω²·τ = 1/θ."""
    assert largest_gain(1.0, 1e-6) == pytest.approx(1e6, rel=1e-3)


@pytest.mark.parametrize(("lag", "dead_time"), [(0.05, 0.04), (0.02, 0.1)])
def test_the_planner_feeds_back_a_quarter_of_what_is_stable(lag, dead_time):
    """At rest on its plan; then a tilt that nobody planned is answered with gain times tilt."""
    planner = make_planner("model-following", gain=50.0, lag=lag, dead_time=dead_time)
    level, aside, target = (1.0, 0.0, 0.0, 0.0), 1e-4, Target(0.0, 0.0, 0.0)
    for _ in range(100):
        planner.rates(level, target, 0.004)
    tilted = (math.cos(0.5 * aside), math.sin(0.5 * aside), 0.0, 0.0)
    roll = planner.rates(tilted, target, 0.004).roll
    stable = -roll / aside / 0.25
    assert (
        rightmost(0.999 * stable, lag, dead_time) < 0.0 < rightmost(1.001 * stable, lag, dead_time)
    )


def test_a_gain_that_is_a_quarter_of_the_stable_one_or_less_is_fed_back_as_it_is():
    axis = AxisResponse(0.0, 0.04)
    assert feedback_gain(9.8, axis) == 9.8
    assert feedback_gain(50.0, axis) == pytest.approx(math.pi / 8.0 / 0.04)
