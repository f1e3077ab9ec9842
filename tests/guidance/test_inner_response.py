"""The lead against the linear response it undoes, integrated independently."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from companion.attitude import Coefficients
from companion.guidance.inner_response import InnerResponse

GAIN = 5.0


def path(t):
    return Coefficients(0.3 * np.sin(1.3 * t + 0.2), 0.2 * np.cos(0.9 * t) + 0.05 * np.sin(2.1 * t))


def speed_at(t, h=1e-5):
    return (np.array(path(t + h)) - np.array(path(t - h))) / (2.0 * h)


@pytest.mark.parametrize("lag", [0.0, 0.05])
@pytest.mark.parametrize("dead_time", [0.0, 0.05])
@pytest.mark.parametrize("follows_model", [True, False])
def test_led_the_linear_response_follows_the_path_without_error(lag, dead_time, follows_model):
    """Begun on the path; what was asked before the start counts, too."""
    response = InnerResponse(GAIN, lag, dead_time, follows_model)

    def slope(t, state):
        target = np.array(response.target(path, t - dead_time))
        late = state[:2] if follows_model else np.array(path(t - dead_time))
        pull = GAIN * (target - late)
        return pull if lag == 0.0 else [*state[2:], *((pull - state[2:]) / lag)]

    start = [*path(0.0)] if lag == 0.0 else [*path(0.0), *speed_at(0.0)]
    times = np.linspace(0.0, 3.0, 200)
    solved = solve_ivp(slope, (0.0, 3.0), start, t_eval=times, rtol=1e-10, atol=1e-12)
    wanted = np.array([path(t) for t in times])
    assert np.abs(solved.y[:2].T - wanted).max() <= 1e-6


def test_without_the_lead_it_is_late():
    response = InnerResponse(GAIN, 0.05, 0.05, True)
    target = np.array(response.target(path, 1.0))
    assert np.abs(target - path(1.0)).max() > 0.05


@pytest.mark.parametrize("follows_model", [True, False])
def test_led_the_heading_follows_its_path_without_error(follows_model):
    gain, lag, dead_time = 2.0, 0.3, 0.1
    response = InnerResponse(gain, lag, dead_time, follows_model)

    def heading(t):
        return 0.4 * np.sin(1.1 * t) + 0.5 * t

    def slope(t, state):
        wanted, rate = response.heading_target(heading, t - dead_time)
        late = state[0] if follows_model else heading(t - dead_time)
        return [state[1], (gain * (wanted - late) + rate - state[1]) / lag]

    start = [heading(0.0), 0.44 + 0.5]
    times = np.linspace(0.0, 3.0, 200)
    solved = solve_ivp(slope, (0.0, 3.0), start, t_eval=times, rtol=1e-10, atol=1e-12)
    assert np.abs(solved.y[0] - heading(times)).max() <= 1e-6


def test_a_heading_that_jumps_by_a_whole_turn_is_not_a_turn():
    response = InnerResponse(2.0, 0.3, 0.0, True)
    wrapped, rate = response.heading_target(
        lambda t: (0.5 * t + np.pi) % (2 * np.pi) - np.pi, 2.0 * np.pi
    )
    assert rate == pytest.approx(0.5, rel=1e-6)
    assert np.cos(wrapped - np.pi) == pytest.approx(1.0, abs=1e-6)


def test_without_a_gain_only_the_rate_is_asked():
    asked, rate = InnerResponse(0.0, 0.3, 0.1, True).heading_target(lambda t: 0.5 * t, 1.0)
    assert (asked, rate) == pytest.approx((0.55, 0.5))


def test_the_time_of_a_step_contains_the_dead_time():
    """A planner that follows its model answers a step as without dead time, that much later."""
    first_order = InnerResponse(5.0, 0.0, 0.0, follows_model=True).step_time(0.1, np.inf)
    assert first_order == pytest.approx(0.2, abs=2e-3)
    late = InnerResponse(5.0, 0.0, 0.08, follows_model=True).step_time(0.1, np.inf)
    assert late == pytest.approx(first_order + 0.08, abs=2e-3)
