"""The dead time by correlation, against vehicles whose dead time is known."""

import numpy as np
import pytest

from companion.identification import dead_time_by_correlation

from .vehicles import RATE_NOISE, Doublets, irregular, lag_with_dead_time, mock_axis, regular


def smooth_flight(lag, dead_time, *, amplitude=0.5, **kind):
    """Half a minute of commands such as a planner gives: filtered noise, about 0.4 s slow."""
    rng = np.random.default_rng(1)
    times = irregular(30.0, rng)
    white = np.interp(times, np.arange(0.0, 31.0, 0.4), rng.normal(size=78))
    commanded = amplitude * white
    rates = lag_with_dead_time(times, commanded, lag, dead_time, **kind)
    return times, commanded, times, rates + rng.normal(0.0, RATE_NOISE, times.size)


@pytest.mark.parametrize(("lag", "dead_time"), [(0.025, 0.045), (0.047, 0.04), (0.37, 0.102)])
def test_behind_the_known_lag_the_dead_time_is_found(lag, dead_time):
    found = dead_time_by_correlation(*smooth_flight(lag, dead_time), lag=lag)
    assert found == pytest.approx(dead_time, abs=0.003)


def test_without_the_lag_a_part_of_the_lag_is_in_it():
    assert 0.055 < dead_time_by_correlation(*smooth_flight(0.03, 0.05)) < 0.08


def test_steps_do_as_well():
    times = regular(Doublets().end, 250)
    commanded = Doublets().at(times)
    rates = lag_with_dead_time(times, commanded, 0.03, 0.06)
    found = dead_time_by_correlation(times, commanded, times, rates, lag=0.03)
    assert found == pytest.approx(0.06, abs=0.002)


def test_behind_the_known_slew_limit_too():
    record = smooth_flight(0.02, 0.015, amplitude=2.0, slew=5.0)
    found = dead_time_by_correlation(*record, lag=0.02, slew=5.0)
    assert found == pytest.approx(0.015, abs=0.003)


def test_the_mocks_roll():
    found = dead_time_by_correlation(*mock_axis(0, Doublets((0.5, 1.0), 0.25)), lag=0.047)
    assert found == pytest.approx(0.040, abs=0.005)


def test_a_hover_says_nothing():
    assert dead_time_by_correlation(*smooth_flight(0.03, 0.05, amplitude=0.003), lag=0.03) is None


def test_rates_that_have_nothing_to_do_with_the_commands_say_nothing():
    times, commanded, _, rates = smooth_flight(0.03, 0.05)
    assert dead_time_by_correlation(times, commanded, times, rates[::-1], lag=0.03) is None


def test_no_control_says_nothing():
    assert dead_time_by_correlation([], [], [], []) is None


@pytest.mark.parametrize("wrong", [{"lag": -0.1}, {"lag": np.nan}, {"slew": 0.0}])
def test_impossible_knowledge_is_an_error(wrong):
    with pytest.raises(ValueError, match="must be"):
        dead_time_by_correlation([0.0], [0.0], [0.0], [0.0], **wrong)
