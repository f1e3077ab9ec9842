"""The feedback gains against SciPy's Riccati solution, and what they make of the chain."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import solve_continuous_are

from companion.guidance.feedback import Weights, horizontal_gains


def chain(lag, drag):
    a = np.array([[0.0, 1.0, 0.0], [0.0, -drag, 1.0], [0.0, 0.0, -1.0 / lag]])
    return a, np.array([[0.0], [0.0], [1.0 / lag]])


@given(st.floats(0.1, 100.0), st.floats(0.0, 100.0), st.floats(0.02, 1.0), st.floats(0.0, 2.0))
def test_the_gains_are_those_of_scipys_riccati_solution(position, velocity, lag, drag):
    a, b = chain(lag, drag)
    riccati = solve_continuous_are(a, b, np.diag([position, velocity, 0.0]), np.eye(1))
    gains = horizontal_gains(Weights(position, velocity), lag, drag)
    found = [gains.position, gains.velocity, gains.acceleration]
    assert found == pytest.approx((b.T @ riccati)[0], rel=1e-6)


def test_the_chain_comes_to_rest_with_little_overshoot():
    a, b = chain(0.25, 1.0)
    gains = horizontal_gains(Weights(16.0, 4.0), 0.25, 1.0)
    closed = a - b @ [[gains.position, gains.velocity, gains.acceleration]]
    assert np.linalg.eigvals(closed).real.max() < -1.0
    state, path = np.array([1.0, 0.0, 0.0]), []
    for _ in range(5000):
        state = state + 1e-3 * closed @ state
        path.append(state[0])
    assert min(path) >= -0.1
    assert abs(path[-1]) <= 1e-3


@pytest.mark.parametrize(
    ("weights", "lag"),
    [
        ((0.0, 1.0), 0.2),
        ((-1.0, 1.0), 0.2),
        ((1.0, -1.0), 0.2),
        ((np.nan, 1.0), 0.2),
        ((1.0, np.inf), 0.2),
        ((1.0, 1.0), 0.0),
        ((1.0, 1.0), np.nan),
    ],
)
def test_impossible_weights_and_lags_are_refused(weights, lag):
    with pytest.raises(ValueError, match="must"):
        horizontal_gains(Weights(*weights), lag)
