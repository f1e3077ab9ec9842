"""The linear models, which are closed solutions, against SciPy's integration and exponential."""

from math import sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from companion.attitude import Coefficients
from companion.attitude.reference import (
    FirstOrderReference,
    Lag,
    SecondOrderReference,
    remaining_distance,
)

START, GOAL = Coefficients(-0.4, -0.5), Coefficients(0.3, 0.1)
SPEED = Coefficients(0.7, -1.1)
DAMPINGS = [0.0, 0.2, 0.7, 1.0 - 1e-9, 1.0, 1.0 + 1e-9, 1.3, 4.0]

coefficients = st.builds(Coefficients, st.floats(-0.7, 0.7), st.floats(-0.7, 0.7))
seconds = st.floats(0.0, 1.0)


def exponential(frequency, damping, dt):
    """(c, ċ) after `dt`, from the matrix exponential of the companion form."""
    system = np.array([[0.0, 1.0], [-(frequency**2), -2.0 * damping * frequency]])
    state = np.array([np.subtract(START, GOAL), SPEED])
    c, speed = expm(system * dt) @ state
    return c + GOAL, speed


@pytest.mark.parametrize("dt", [1e-3, 0.02, 0.3, 1.5])
@pytest.mark.parametrize("damping", DAMPINGS)
def test_second_order_is_the_matrix_exponential(damping, dt):
    model = SecondOrderReference(7.0, damping)
    c, speed = model.after(START, SPEED, GOAL, dt)
    expected_c, expected_speed = exponential(7.0, damping, dt)
    assert np.array(c) == pytest.approx(expected_c, abs=1e-12)
    assert np.array(speed) == pytest.approx(expected_speed, abs=1e-11)


def behind_a_lag(gain, lag):
    """A proportional gain p (1/s) behind a lag τ (s): c̈ = (p·(c_d − c) − ċ)/τ."""
    return SecondOrderReference(sqrt(gain / lag), 0.5 / sqrt(gain * lag))


@pytest.mark.parametrize(("gain", "lag"), [(5.0, 0.02), (5.0, 0.05), (5.0, 0.2), (2.0, 0.5)])
def test_second_order_with_a_lag_is_first_order_behind_it(gain, lag):
    """Two first-order systems in a row, integrated: the lag's output is the speed."""
    solution = solve_ivp(
        lambda _, s: np.concatenate([s[2:], (gain * (np.array(GOAL) - s[:2]) - s[2:]) / lag]),
        (0.0, 0.8),
        [*START, *SPEED],
        t_eval=[0.1, 0.8],
        rtol=1e-11,
        atol=1e-13,
        method="DOP853",
    )
    model = behind_a_lag(gain, lag)
    for t, state in zip(solution.t, solution.y.T, strict=True):
        c, speed = model.after(START, SPEED, GOAL, float(t))
        assert [*c, *speed] == pytest.approx(state, abs=1e-9)
    assert behind_a_lag(5.0, 0.05).damping == pytest.approx(1.0, abs=1e-15)


def test_an_overdamped_model_a_long_time_later():
    model = behind_a_lag(5.0, 1e-3)
    c, speed = model.after(START, SPEED, GOAL, 2.0)
    expected_c, expected_speed = exponential(model.frequency, model.damping, 2.0)
    assert [*c, *speed] == pytest.approx([*expected_c, *expected_speed], abs=1e-9)


def test_a_large_damping_leaves_the_slow_pole_exact():
    """As with a tiny gain and a short lag of second order; 2ζ/ω is 250 000 s."""
    from_c, _, _, _ = SecondOrderReference(2e4, 2.5e9).transition(0.05)
    assert 1.0 - from_c == pytest.approx(0.05 / 250_000.0, rel=1e-6)


@pytest.mark.parametrize("max_speed", [np.inf, 2.0, 0.4])
@pytest.mark.parametrize("dt", [1e-3, 0.05, 0.6])
def test_first_order_is_the_integral_of_its_slope(max_speed, dt):
    def slope(_, c):
        speed = 5.0 * (np.array(GOAL) - c)
        return speed / max(1.0, np.hypot(*speed) / max_speed)

    solution = solve_ivp(slope, (0.0, dt), START, rtol=1e-11, atol=1e-13, max_step=1e-3)
    after = FirstOrderReference(5.0, max_speed).after(START, GOAL, dt)
    assert np.array(after) == pytest.approx(solution.y[:, -1], abs=1e-8)


@given(coefficients, coefficients, seconds, seconds, st.sampled_from([np.inf, 3.0, 0.5]))
def test_first_order_in_two_steps_is_one_step(c, goal, first, second, max_speed):
    model = FirstOrderReference(5.0, max_speed)
    halfway = model.after(c, goal, first)
    twice = model.after(halfway, goal, second)
    assert twice == pytest.approx(model.after(c, goal, first + second), abs=1e-13)


@given(coefficients, coefficients, coefficients, seconds, seconds, st.sampled_from(DAMPINGS))
def test_second_order_in_two_steps_is_one_step(c, speed, goal, first, second, damping):
    model = SecondOrderReference(6.0, damping)
    halfway = model.after(c, speed, goal, first)
    twice = model.after(*halfway, goal, second)
    once = model.after(c, speed, goal, first + second)
    assert [*twice[0], *twice[1]] == pytest.approx([*once[0], *once[1]], abs=1e-11)


def test_a_model_at_its_target_stays_there():
    assert FirstOrderReference(5.0, 0.3).after(GOAL, GOAL, 0.1) == GOAL
    still = Coefficients(0.0, 0.0)
    assert SecondOrderReference(5.0, 0.7).after(GOAL, still, GOAL, 0.1) == (GOAL, still)


@pytest.mark.parametrize("max_speed", [np.inf, 1.0])
def test_no_time_leaves_the_whole_distance(max_speed):
    assert remaining_distance(0.6, 5.0, max_speed, 0.0) == 0.6


@pytest.mark.parametrize("sigma", [0.0, 0.0004, 0.003])
@pytest.mark.parametrize("dt", [0.004, 0.05])
def test_a_lag_is_its_differential_equation(sigma, dt):
    """σ·r̈ + lag·ṙ = command − r: the integral, r and ṙ, and the transition of (r − command, ṙ)."""
    lag, rate, slope, command = 0.06, 0.5, -2.0, 1.5

    def derivatives(_, state):
        _, r, r_dot = state
        if sigma == 0.0:
            return r, (command - r) / lag, 0.0
        return r, r_dot, (command - r - lag * r_dot) / sigma

    start = 0.0, rate, slope
    end = solve_ivp(derivatives, (0.0, dt), start, rtol=1e-11, atol=1e-12).y[:, -1]
    if sigma == 0.0:
        end[2] = (command - end[1]) / lag
    assert Lag(lag, sigma).after(rate, slope, command, dt) == pytest.approx(end, rel=1e-8)
    rows = np.reshape(Lag(lag, sigma).transition(dt), (2, 2))
    expected = (end[1] - command, end[2] if sigma > 0.0 else 0.0)
    assert rows @ (rate - command, slope) == pytest.approx(expected, rel=1e-8)
