"""The dead time by correlation, against vehicles whose dead time is known."""

from math import radians
from pathlib import Path

import numpy as np
import pytest

from companion.identification import dead_time_by_correlation
from companion.identification.lags import first_order_response, held_commands, slew_limited

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


SAMPLINGS = {
    "250 Hz": [4],
    "PX4, asked for 250 Hz": [4, 4, 8, 4, 4, 4, 8],
    "ArduPilot, some in pairs": [5, 5, 3, 2, 5, 5, 5, 2, 3],
    "100 Hz": [10],
}
"""Steps of the stamps, ms."""


@pytest.mark.parametrize("steps", SAMPLINGS.values(), ids=SAMPLINGS)
@pytest.mark.parametrize("lag", [0.012, 0.02, 0.047, 0.08])
@pytest.mark.parametrize("dead_time", [0.006, 0.018, 0.04, 0.1])
def test_it_is_found_whatever_the_response_and_the_sampling(dead_time, lag, steps):
    rng = np.random.default_rng(round(1e6 * dead_time * lag))
    stamps = np.cumsum(np.resize(steps, int(10_000 / np.mean(steps)))) * 1e-3
    commanded = 0.5 * np.interp(stamps, np.arange(0.0, 11.0, 0.3), rng.normal(size=37))
    rates = lag_with_dead_time(stamps, commanded, lag, dead_time)
    rates += rng.normal(0.0, RATE_NOISE, stamps.size)
    found = dead_time_by_correlation(stamps, commanded, stamps, rates, lag)
    assert found == pytest.approx(dead_time, abs=0.003)


def with_integrator(times, commanded, dead_time=0.010, gain=14.0, reset=1.33, lag=0.03):
    """A rate loop as PX4's: proportional and integral, behind motors that lag. By steps of 1 ms.

    Turning slowly it is late by much less than stepping, because its integrator makes up for it.
    """
    fine = np.arange(times[0], times[-1] + 1e-3, 1e-3)
    asked = commanded[np.maximum(np.searchsorted(times, fine - dead_time, side="right") - 1, 0)]
    rate = turning = integral = 0.0
    rates = []
    for target in asked.tolist():
        rates.append(rate)
        error = target - rate
        integral += reset * error * 1e-3
        turning += (gain * (error + integral) - turning) * 1e-3 / lag
        rate += turning * 1e-3
    return np.interp(times, fine, rates)


def test_circles_and_steps_tell_the_same_of_a_loop_that_catches_up():
    times = np.cumsum(np.resize([4, 4, 8], 5000)) * 1e-3
    rng = np.random.default_rng(3)
    feedback = 0.05 * np.interp(times, np.arange(0.0, 30.0, 0.25), rng.normal(size=120))
    circle = 0.5 * np.sin(times) + feedback
    steps = np.where(times % 4.0 < 2.0, 0.5, -0.5) * (times % 2.0 < 1.0)
    by_circle, by_steps = (
        dead_time_by_correlation(times, each, times, with_integrator(times, each), lag=0.047)
        for each in (circle, steps)
    )
    assert by_circle == pytest.approx(by_steps, abs=0.003)


RECORDINGS = Path(__file__).parent / "recordings"
LAG = {"px4": 0.047, "ardupilot": 0.018}
SLEW = {"px4": None, "ardupilot": radians(1100.0)}


def recorded(autopilot, flown, axis):
    record = np.load(RECORDINGS / f"{autopilot}-{flown}.npz")
    time = 1e-3 * record["time_ms"].astype(float)
    rates = (record[name][:, axis].astype(float) for name in ("commanded", "measured"))
    commanded, measured = rates
    return time, commanded, time, measured


def by_least_squares(time, commanded, measured_time, measured, lag, slew):
    """The dead time with which the known lag comes nearest to what was measured."""
    knots = held_commands(time, commanded)
    knots = knots if slew is None else slew_limited(knots, slew)
    sure = measured_time > time[0] + 0.5
    tried = np.arange(0.0, 0.1, 0.0005)
    misfits = [
        np.var(measured[sure] - first_order_response(knots, lag, measured_time[sure] - dead_time))
        for dead_time in tried
    ]
    return float(tried[np.argmin(misfits)])


@pytest.mark.parametrize("axis", [0, 1], ids=["roll", "pitch"])
@pytest.mark.parametrize("autopilot", LAG)
def test_on_real_autopilots_any_flight_tells_the_same(autopilot, axis):
    """Cut from flights of this program on PX4 (SIH) and ArduCopter (SITL), 22 November 2026.

    `commanded` and `measured` are (n, 2), roll and pitch, rad/s, at the vehicle's `time_ms`.
    """
    known = LAG[autopilot], SLEW[autopilot]
    right = by_least_squares(*recorded(autopilot, "doublets", axis), *known)
    told = [
        dead_time_by_correlation(*recorded(autopilot, flown, axis), *known)
        for flown in ("doublets", "corners", "circle")
    ]
    assert told == pytest.approx([right] * 3, abs=0.0035)


@pytest.mark.parametrize("flown", ["circle", "corners", "doublets"])
def test_px4s_response_of_second_order_tells_a_shorter_dead_time(flown):
    """Fitted on doublets: ω 19.6 rad/s, ζ 0.73, dead time 8.5 ms."""
    found = dead_time_by_correlation(*recorded("px4", flown, 0), 2 * 0.73 / 19.6, damping=0.73)
    assert found == pytest.approx(0.0085, abs=0.005)


def test_what_something_else_moves_says_nothing():
    """Gusts as strong as a fifth of what was asked for."""
    times, commanded, _, rates = smooth_flight(0.03, 0.05)
    rng = np.random.default_rng(5)
    gusts = 0.1 * np.interp(times, np.arange(0.0, 31.0, 0.3), rng.normal(size=104))
    assert dead_time_by_correlation(times, commanded, times, rates + gusts, lag=0.03) is None


def test_without_the_lag_a_part_of_the_lag_is_in_it():
    assert 0.07 < dead_time_by_correlation(*smooth_flight(0.03, 0.05)) < 0.085


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
