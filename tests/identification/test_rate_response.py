"""Lag, dead time, gain and slew limit come back out of records made by other means."""

from dataclasses import replace

import numpy as np
import pytest

from companion.identification import FitNeeds, fit_rate_response, identify_vehicle

from .vehicles import RATE_NOISE, Doublets, irregular, lag_with_dead_time, mock_axis, regular

QUICK, SLOW = Doublets(), Doublets(width=0.6)


def fly(doublets, lag, dead_time, *, rate_hz=None, seed=0, offset=0.0, noise=RATE_NOISE, **kind):
    rng = np.random.default_rng(seed)
    times = irregular(doublets.end, rng) if rate_hz is None else regular(doublets.end, rate_hz)
    commanded = doublets.at(times)
    rates = lag_with_dead_time(times, commanded, lag, dead_time, **kind)
    return times, commanded, times, rates + offset + rng.normal(0.0, noise, times.size)


@pytest.mark.parametrize("rate_hz", [50, 250, None])
@pytest.mark.parametrize(("lag", "dead_time"), [(0.015, 0.015), (0.025, 0.045), (0.06, 0.0173)])
def test_tilt_axes_come_back(lag, dead_time, rate_hz):
    found = fit_rate_response(*fly(QUICK, lag, dead_time, rate_hz=rate_hz))
    assert found.lag == pytest.approx(lag, rel=0.05)
    assert found.dead_time == pytest.approx(dead_time, abs=0.001)
    assert found.gain == pytest.approx(1.0, abs=0.01)
    assert found.slew is None
    assert found.is_good(), found.flaw()


def test_a_slow_axis_with_gain_and_offset_comes_back():
    found = fit_rate_response(*fly(SLOW, 0.37, 0.102, gain=0.92, offset=0.03))
    assert found.lag == pytest.approx(0.37, rel=0.02)
    assert found.dead_time == pytest.approx(0.102, abs=0.001)
    assert found.gain == pytest.approx(0.92, abs=0.01)
    assert found.is_good(), found.flaw()


@pytest.mark.parametrize(
    ("doublets", "lag", "dead_time", "slew"),
    [(QUICK, 0.02, 0.015, 19.2), (SLOW, 0.06, 0.16, 4.7)],
)
def test_a_slew_limit_is_told_from_the_lag(doublets, lag, dead_time, slew):
    found = fit_rate_response(*fly(doublets, lag, dead_time, slew=slew))
    assert found.slew == pytest.approx(slew, rel=0.03)
    assert found.lag == pytest.approx(lag, rel=0.1)
    assert found.dead_time == pytest.approx(dead_time, abs=0.002)


def test_errors_are_of_the_size_of_what_noise_does():
    records = [fly(QUICK, 0.03, 0.03, seed=seed, noise=0.02) for seed in range(10)]
    found = [fit_rate_response(*record) for record in records]
    dead_time = [(each.dead_time - 0.03) / each.fit.dead_time_error for each in found]
    lag = [(each.lag - 0.03) / each.fit.lag_error for each in found]
    for apart in (dead_time, lag):
        assert 0.4 < np.sqrt(np.mean(np.square(apart))) < 1.8


def test_a_pause_parts_two_stretches_and_what_was_commanded_in_between_does_no_harm():
    first = fly(QUICK, 0.03, 0.04)
    second = fly(QUICK, 0.03, 0.04, seed=5)
    later = first[0][-1] + 3.0
    times = np.concatenate((first[0], second[0] + later))
    commanded = np.concatenate((first[1], second[1]))
    between = np.arange(first[0][-1] + 0.01, later, 0.01)
    measured_time = np.concatenate((first[2], between, second[2] + later))
    measured = np.concatenate((first[3], np.sin(9.0 * between), second[3]))
    found = fit_rate_response(times, commanded, measured_time, measured)
    assert found.lag == pytest.approx(0.03, rel=0.05)
    assert found.dead_time == pytest.approx(0.04, abs=0.001)


def test_a_turn_at_the_start_of_the_record_does_no_harm():
    times, commanded, _, rates = fly(SLOW, 0.37, 0.1)
    decaying = 0.4 * np.exp(-times / 0.37)
    found = fit_rate_response(times, commanded, times, rates + decaying)
    assert found.lag == pytest.approx(0.37, rel=0.02)
    assert found.dead_time == pytest.approx(0.1, abs=0.001)


def test_rows_without_a_number_are_left_out_and_order_does_not_matter():
    times, commanded, _, rates = fly(QUICK, 0.03, 0.04)
    whole = fit_rate_response(times, commanded, times, rates)
    shuffled = np.random.default_rng(3).permutation(times.size)
    again = fit_rate_response(
        np.append(times, 1.0),
        np.append(commanded, np.nan),
        np.append(times[shuffled], 2.0),
        np.append(rates[shuffled], np.nan),
    )
    assert again == whole


@pytest.mark.parametrize("axis", [0, 1])
def test_the_mocks_roll_and_pitch_are_those_measured_on_px4(axis):
    """Second order (19.6 rad/s, 0.73, 8.5 ms); best fitted first order by 47 + 40 ms at gain 1."""
    found = fit_rate_response(*mock_axis(axis, Doublets((0.5, 1.0), 0.25)), gain=1.0)
    assert found.lag == pytest.approx(0.047, rel=0.15)
    assert found.dead_time == pytest.approx(0.040, abs=0.005)
    assert found.slew is None
    assert found.is_good(), found.flaw()


@pytest.mark.parametrize("sizes", [(0.5,), (0.3, 0.6, 1.2)])
def test_overshoot_is_not_taken_for_a_slew_limit(sizes):
    assert fit_rate_response(*mock_axis(0, Doublets(sizes, 0.15))).slew is None


def test_the_mocks_yaw_is_as_late_and_as_short_as_the_one_measured_on_px4():
    """Second order (5.6 rad/s, 0.94, 45 ms) of gain 0.92: late by 2ζ/ω + θ on the whole."""
    found = fit_rate_response(*mock_axis(2, Doublets((0.5,), 1.0)))
    assert found.lag + found.dead_time == pytest.approx(2 * 0.94 / 5.6 + 0.045, rel=0.1)
    assert found.gain == pytest.approx(0.92, abs=0.03)
    assert found.slew is None
    assert found.is_good(), found.flaw()


def test_constant_commands_find_nothing_and_say_so():
    times = regular(5.0, 100)
    found = fit_rate_response(times, np.zeros(500), times, np.zeros(500))
    assert np.isnan([found.lag, found.dead_time, found.gain]).all()
    assert "too little excitation" in found.flaw()


def test_small_commands_are_too_little():
    found = fit_rate_response(*fly(Doublets((0.05,)), 0.03, 0.04))
    assert found.flaw() == ("too little excitation: the commands span 0.10 rad/s, 0.20 are needed")
    assert found.is_good(FitNeeds(span=0.1 - 1e-9))


def test_rates_that_do_not_follow_or_are_lost_in_noise_are_refused():
    times, commanded, _, rates = fly(QUICK, 0.03, 0.04)
    noise = np.random.default_rng(2).normal(0.0, 0.5, rates.size)
    assert not fit_rate_response(times, commanded, times, noise).is_good()
    lost = fit_rate_response(times, commanded, times, rates + noise)
    assert lost.flaw().startswith("lag and dead time are uncertain by")


def test_half_the_gain_is_refused():
    found = fit_rate_response(*fly(QUICK, 0.03, 0.04, gain=0.5))
    assert found.flaw() == "gain 0.50 is not near 1: the rates did not follow the commands"


def test_a_dead_time_past_what_is_searched_is_refused():
    found = fit_rate_response(*fly(Doublets((0.5,), 1.0), 0.03, 0.6))
    assert "dead time is at the edge" in found.flaw()


def test_a_response_that_comes_before_its_command_is_refused():
    times, commanded, _, rates = fly(QUICK, 0.03, 0.0)
    found = fit_rate_response(times, commanded, times - 0.05, rates)
    assert "dead time is at the edge" in found.flaw()


def test_too_few_samples_and_too_much_doubt_are_refused():
    found = fit_rate_response(*fly(QUICK, 0.03, 0.04))
    few = replace(found, fit=replace(found.fit, excited_samples=19))
    doubtful = replace(found, fit=replace(found.fit, lag_error=0.0081))
    assert few.flaw() == "too little excitation: 19 samples show the response, 20 are needed"
    assert doubtful.flaw() == "lag and dead time are uncertain by 8.1 ms"


def test_times_without_their_values_are_an_error():
    with pytest.raises(ValueError, match="equally long"):
        fit_rate_response([0.0, 0.1], [0.0], [0.0], [0.0])


def test_times_that_do_not_meet_are_named_as_the_reason():
    """It said that the commands span 0.00 rad/s, of commands that span 2 rad/s."""
    time = np.arange(0.0, 10.0, 0.004)
    commanded = np.sign(np.sin(2.0 * time))
    for scale, shift in ((1.0, 1000.0), (1000.0, 0.0)):  # another clock; ms
        found = fit_rate_response(scale * time, commanded, scale * time + shift, commanded)
        assert "rates need times in s on one clock" in found.flaw()


@pytest.mark.parametrize(
    ("name", "shapes"),
    [
        ("setpoints", ((9, 4), (9, 4), (0, 2))),
        ("setpoints", ((5, 10), (9, 4), (0, 2))),
        ("rates", ((9, 5), (4, 9), (0, 2))),
        ("specific_thrust", ((9, 5), (9, 4), (9,))),
    ],
)
def test_rows_of_another_shape_are_named(name, shapes):
    with pytest.raises(ValueError, match=rf"{name} must have the shape \(n, \d\), not \("):
        identify_vehicle(*map(np.zeros, shapes))
