"""The planned motion against numerical integration, and its lines and limits."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from companion.attitude import Coefficients, Limits, Target
from companion.attitude.kinematics import rotate_to_heading
from companion.attitude.limits import make_constants
from companion.attitude.reference_model import (
    ReferenceModel,
    braking_lead,
    model_response,
    rates_along,
)
from tests.attitude.independent import attitudes, coefficients_of, headings_of, held, rate_between

W_M = np.pi / 2
START, GOAL = (-0.4, -0.5), (0.4, -0.5)
AT_REST = Coefficients(0.0, 0.0)


def placed(start, limits=Limits(), lag=0.05, speed=AT_REST, gain=5.0, **response):  # noqa: B008
    model = ReferenceModel(make_constants(gain, 2.0, limits), lag, **response)
    model.start_at(Coefficients(*start), Coefficients(*speed))
    return model


def moved(model, target, seconds, dt):
    """(S + 1, 4): north, east, their speeds."""

    def state():
        return model.north, model.east, model.speed_north, model.speed_east

    rows = [state()]
    for _ in range(round(seconds / dt)):
        model.advance(target, dt)
        rows.append(state())
    return np.array(rows)


@pytest.mark.parametrize(("dt", "error"), [(0.004, 1e-3), (0.02, 2e-2), (0.2, 2e-2)])
@pytest.mark.parametrize("sigma", [0.0, 0.0015, 0.0026])
@pytest.mark.parametrize("lag", [0.05, 0.0745, 0.12])
def test_unlimited_it_is_the_differential_equation(lag, sigma, dt, error):
    """σ·c⃛ + τ·c̈ + (1 + p·κ)·ċ = p·(c_d − c), up to what v changes within a step."""
    speed, order = (0.3, -0.4), 2 if sigma == 0.0 else 3
    rows = moved(placed(START, lag=lag, speed=speed, sigma=sigma), Target(*GOAL, 0.3), 1.6, dt)
    slowed = max(1.0, (2.7 * 5.0 * lag) ** 0.5)

    def derivative(_, state):
        c, speed_, bend = state.reshape(3, 2)  # the last one is not a state of second order
        push = 5.0 * (np.array(GOAL) - c) - slowed * speed_
        if order == 2:
            return np.concatenate((speed_, push / lag, (0.0, 0.0)))
        return np.concatenate((speed_, bend, (push - lag * bend) / sigma))

    solved = solve_ivp(
        derivative,
        (0.0, 1.6),
        [*START, *speed, 0.0, 0.0],
        t_eval=np.linspace(0.0, 1.6, len(rows)),
        rtol=1e-9,
        atol=1e-11,
    )
    assert rows[:, :2] == pytest.approx(solved.y.T[:, :2], abs=0.1 * error)
    assert rows[:, 2:] == pytest.approx(solved.y.T[:, 2:4], abs=error)


@pytest.mark.parametrize(("lag", "damping"), [(0.05, 0.7), (0.0745, 0.73), (0.12, 0.7), (0.3, 1.0)])
def test_a_slow_rate_loop_makes_it_overshoot_by_a_few_percent_at_most(lag, damping):
    model = placed(START, lag=lag, sigma=(0.5 * lag / damping) ** 2)
    rows = moved(model, Target(*GOAL, 0.3), 3.0, 0.004)
    assert rows[:, 0].max() <= GOAL[0] + 0.05 * (GOAL[0] - START[0])
    assert rows[-1, 0] == pytest.approx(GOAL[0], abs=0.02)


@pytest.mark.parametrize("sigma", [0.0015, 0.0026])
def test_what_a_second_order_is_sent_is_smooth_and_moves_it_along(sigma):
    """Led by τ and σ its rates keep the limit, and their slopes are what they become."""
    lag, dt = 0.0745, 0.004
    model = placed(START, Limits(None, W_M), lag, sigma=sigma)
    rates, slopes = [np.array(model.rates()[:2])], [np.array(model.rate_slopes(*model.rates()[:2]))]
    for _ in range(300):
        model.advance(Target(*GOAL, 0.3), dt)
        rates.append(np.array(model.rates()[:2]))
        slopes.append(np.array(model.rate_slopes(*rates[-1])))
    rates, slopes = np.array(rates), np.array(slopes)
    mean = 0.5 * (slopes[1:] + slopes[:-1])
    assert np.diff(rates, axis=0) / dt == pytest.approx(mean, abs=0.15)
    led = 0.5 * (rates[1:] + rates[:-1]) + lag * mean + sigma * np.diff(slopes, axis=0) / dt
    assert np.hypot(*led.T).max() <= 1.03 * W_M
    assert np.hypot(*led.T).max() >= 0.98 * W_M


LIMITS = [
    Limits(None, W_M),
    Limits(np.radians(50), W_M),
    Limits(np.radians(50), W_M, shape="paper"),
    Limits(np.radians(50), 0.4),
]


@pytest.mark.parametrize("limits", LIMITS)
@pytest.mark.parametrize("dt", [0.004, 0.02])
def test_a_step_moves_on_a_straight_line_within_the_limits(limits, dt):
    rows = moved(placed(START, limits), Target(*GOAL, 0.3), 4.0, dt)
    assert np.abs(rows[:, 1] + 0.5).max() <= 1e-12
    assert np.diff(rows[:, 0]).min() >= -1e-9  # never back
    assert rows[-1, :2] == pytest.approx(GOAL, abs=2e-2 if limits.tilt_rate < 1.0 else 1e-3)
    r = attitudes(rows[:, :2], np.zeros(len(rows)))
    tilt_rate = np.hypot(*rate_between(r[:-1], r[1:], dt)[:, :2].T)
    assert tilt_rate.max() <= 1.03 * limits.tilt_rate
    speed = np.hypot(*rows[:, 2:].T).max()
    if limits.shape == "paper":
        assert speed == pytest.approx(W_M * np.cos(np.radians(50)), rel=1e-2)
    else:
        assert tilt_rate.max() >= 0.97 * limits.tilt_rate  # nothing is given away


@pytest.mark.parametrize("acceleration", [6.0, 12.0, 19.2])
@pytest.mark.parametrize("gain", [5.0, 9.0])
def test_what_is_commanded_changes_no_faster_than_the_autopilot_lets_it(acceleration, gain):
    """The tilt rate led by the lag, as it is fed forward; and it does not overshoot for that."""
    lag, dt = 0.25 / gain, 0.004
    model = placed(START, Limits(None, W_M), lag, gain=gain, acceleration=acceleration)
    led, path = [], []
    for _ in range(600):
        before = np.array(model.rates())
        model.advance(Target(*GOAL, 0.3), dt)
        after = np.array(model.rates())
        led.append(0.5 * (before + after) + lag * (after - before) / dt)
        path.append((model.north, model.east))
    led = np.array(led)
    change = np.hypot(*(led[5:] - led[:-5])[:, :2].T) / (5.0 * dt)
    assert change.max() <= 1.1 * acceleration
    assert change.max() >= 0.9 * acceleration  # nothing is given away
    north, east = np.array(path).T
    assert np.abs(east + 0.5).max() <= 1e-12
    assert north.max() <= GOAL[0] + 0.012
    assert north[-1] == pytest.approx(GOAL[0], abs=1e-3)


def test_the_tilt_limit_holds_for_a_motion_that_would_leave_it():
    limits = Limits(np.radians(40), W_M)
    longest = np.sin(np.radians(40))
    rows = moved(placed((0.63, 0.0), limits, speed=(1.5, 0.8)), Target(0.5, 0.0, 0.3), 2.0, 0.01)
    length = np.hypot(*rows[:, :2].T)
    assert length.max() <= longest * (1.0 + 1e-12)
    assert length.max() == pytest.approx(longest, rel=1e-6)  # it was tried
    assert rows[-1, :2] == pytest.approx((0.5, 0.0), abs=1e-3)


def test_placed_beyond_the_tilt_limit_it_goes_no_further_and_comes_back():
    limits = Limits(np.radians(40), W_M)
    rows = moved(placed((0.8, 0.3), limits, speed=(1.0, 0.0)), Target(0.5, 0.0, 0.3), 3.0, 0.01)
    length = np.hypot(*rows[:, :2].T)
    assert length.max() <= np.hypot(0.8, 0.3) + 1e-12
    assert rows[-1, :2] == pytest.approx((0.5, 0.0), abs=1e-3)


def test_its_rates_move_the_attitude_along_it():
    """`rates_along`, by a small turn of a SciPy rotation: this speed, and the heading still."""
    rng = np.random.default_rng(4)
    for north, east, heading, *speed in rng.uniform(-0.65, 0.65, (50, 5)) * [1, 1, 4.8, 2, 2]:
        r_x, r_y, r_z = rates_along(north, east, *speed)
        rates = (*rotate_to_heading(np.cos(heading), np.sin(heading), r_x, r_y), r_z)
        r = attitudes((north, east), heading)
        h = 1e-5
        ahead, behind = held(r, [rates], h), held(r, [rates], -h)
        got = (coefficients_of(ahead) - coefficients_of(behind))[0] / (2.0 * h)
        assert got == pytest.approx(speed, abs=1e-8)
        assert headings_of(ahead)[0] == pytest.approx(headings_of(behind)[0], abs=1e-12)


@pytest.mark.parametrize(("gain", "lag"), [(5.0, 0.05), (6.0, 0.12), (3.0, 0.4)])
def test_the_response_of_the_model_is_its_differential_equation_divided(gain, lag):
    """τ·c̈ + ċ = p·(c_d − c − κ·ċ), solved for c̈ = (p'·(c_d − c) − ċ)/τ'."""
    slope, error = 0.7, 0.2
    found_gain, found_lag = model_response(gain, lag)
    ahead = braking_lead(gain, lag)
    expected = (gain * (error - ahead * slope) - slope) / lag
    assert (found_gain * error - slope) / found_lag == pytest.approx(expected)


def test_the_model_brakes_ahead_only_where_it_would_overshoot():
    assert braking_lead(5.0, 0.05) == 0.0
    assert braking_lead(6.0, 0.12) == pytest.approx((2.7 * 0.12 / 6.0) ** 0.5 - 1.0 / 6.0)
