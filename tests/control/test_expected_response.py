"""The expected response against planners that fly a rate loop, and the words about it."""

from math import exp
from pathlib import Path

import numpy as np
import pytest

from companion.attitude import Coefficients, Target, attitude, coefficients
from companion.config import Config
from companion.config.files import changed, load
from companion.control.expected_response import (
    ExpectedResponse,
    expectations,
    expected_response,
    gain_warning,
    hold_sentence,
)
from companion.control.hold_settings import hold_gains
from companion.control.inner_loop import planner
from companion.control.outer_loop import linear_settings
from companion.study.lag_loop import LagLoop

CONFIGS = Path(__file__).parents[2] / "configs"
PX4 = {"lag_ms": 47, "dead_time_ms": 40}
BASE = Config.model_validate({"vehicle": PX4})
STEP = 0.25


def configured(name, gain, rate=90.0, **vehicle):
    changes = {
        "planner": {"name": name, "gain_per_s": gain},
        "limits": {"max_tilt_rate_deg_s": rate},
        "vehicle": {**PX4, **vehicle},
    }
    return changed(BASE, changes, "test")


def flown(config, lag_ms, dead_time_ms, begin=(-STEP, 0.0), end=(STEP, 0.0)):
    """Coefficients (n, 2) of a step, 250 times a second."""
    start, target = attitude(Coefficients(*begin), 0.0), Target(*end, 0.0)
    loop = LagLoop(lag_ms, dead_time_ms)
    flight = loop.fly(planner(config), start, target, seconds=2.0, rate_hz=250)
    return np.array([coefficients(tuple(q)) for q in flight.q])


@pytest.mark.parametrize("name", ["model-following", "first-order"])
@pytest.mark.parametrize("rate", [60.0, 90.0, 400.0])
@pytest.mark.parametrize("gain", [2.5, 5.0, 10.0])
def test_the_time_constant_is_that_of_a_simulated_step(name, rate, gain):
    config = configured(name, gain, rate)
    north = flown(config, 47, 40)[:, 0]
    covered = np.argmax(north >= -STEP + 2.0 * STEP * (1.0 - exp(-1.0))) / 250.0
    assert expected_response(config).time_constant == pytest.approx(covered, abs=0.012)


@pytest.mark.parametrize(
    ("gain", "rate", "vehicle", "limit"),
    [
        (2.5, 400.0, {}, "planner.gain_per_s"),
        (10.0, 90.0, {}, "limits.max_tilt_rate_deg_s"),
        (10.0, 400.0, {"dead_time_ms": 90}, "the vehicle's dead time"),
        (10.0, 400.0, {"lag_ms": 150, "dead_time_ms": 15}, "the vehicle's lag"),
    ],
)
def test_what_limits_the_response_is_what_makes_it_quicker_when_changed(gain, rate, vehicle, limit):
    config = configured("model-following", gain, rate, **vehicle)
    found = expected_response(config)
    assert found.main_cause == limit
    assert f"{limit} lengthens the time constant most (" in found.sentence()
    changes = {
        "planner.gain_per_s": {"planner": {"gain_per_s": 2.0 * gain}},
        "limits.max_tilt_rate_deg_s": {"limits": {"max_tilt_rate_deg_s": 1000.0}},
        "the vehicle's lag": {"vehicle": {"lag_ms": 0.0}},
        "the vehicle's dead time": {"vehicle": {"dead_time_ms": 0.0}},
    }
    for name, change in changes.items():
        now = expected_response(changed(config, change, "test")).time_constant
        assert now == pytest.approx(found.time_constants_without_cause[name], abs=0.004)


def test_the_largest_sensible_gain_and_a_warning_above_it():
    assert expected_response(configured("model-following", 5.0)).largest_gain == pytest.approx(
        0.45 / 0.087
    )
    assert not expected_response(configured("model-following", 5.0)).gain_is_too_high
    found = expected_response(configured("model-following", 5.0))
    unlimited = expected_response(configured("model-following", found.largest_gain, 1000.0))
    shortest = found.shortest_time_constant
    assert shortest == pytest.approx(unlimited.time_constant, abs=0.002)
    assert found.sentence().endswith(f"and no rate limit: {shortest:.2f} s")
    quick = expected_response(configured("first-order", 6.0))
    assert quick.gain_is_too_high
    assert "6, and 5.2 is the largest sensible one (0.45 / (lag + dead time)); lower it" in (
        quick.gain_sentence()
    )
    unknown = expected_response(Config())
    assert unknown.largest_gain is None
    assert unknown.shortest_time_constant is None
    assert "no rate limit" not in unknown.sentence()
    assert unknown.gain_sentence() == (
        "the largest sensible gain is not known before `companion identify`"
    )


def test_the_words_about_a_response():
    time_constants_without_cause = {
        "planner.gain_per_s": 0.4,
        "limits.max_tilt_rate_deg_s": 0.3,
        "the vehicle's lag": 0.495,  # 1 % less is not told
    }
    found = ExpectedResponse(0.25, 0.5, time_constants_without_cause, 5.0, 5.0)
    assert found.sentence() == (
        "a step from -0.25 to 0.25 (±14° of tilt) is expected to have a time constant of 0.50 s; "
        "limits.max_tilt_rate_deg_s lengthens the time constant most (0.30 s without "
        "limits.max_tilt_rate_deg_s, 0.40 s with planner.gain_per_s doubled)"
    )
    assert not found.gain_is_too_high
    assert found.gain_sentence() == (
        "planner.gain_per_s is 5, and 5.0 is the largest sensible one (0.45 / (lag + dead time))"
    )


def test_only_our_own_planners_have_an_expected_response_and_a_warning():
    quick = configured("first-order", 6.0)
    assert gain_warning(quick) == expected_response(quick).gain_sentence()
    assert gain_warning(configured("first-order", 5.0)) is None
    assert gain_warning(Config()) is None
    assert len(expectations(quick)) == 3
    other = quick.planner.model_copy(update={"name": "someones-planner"})
    others = quick.model_copy(update={"planner": other})
    assert gain_warning(others) is None
    assert expectations(others) == [hold_sentence(others)]


def test_the_gains_that_are_told_are_those_that_fly():
    config = configured("model-following", 5.0)
    gains = linear_settings(config).gains
    assert gains == hold_gains(config)
    told = expectations(config)[-1]
    assert f"{gains.position:.1f} 1/s² on position, {gains.velocity:.1f} 1/s on velocity" in told


@pytest.mark.parametrize(("lag", "dead_time"), [(20, 15), (47, 40), (73, 54), (100, 80)])
def test_the_times_of_another_vehicle_do_less_harm_than_none(lag, dead_time):
    """The decision behind the shipped files, at their gain and their tilt: docs/identify.md."""
    shipped = load(CONFIGS / "vehicle-px4.yaml").vehicle.axes["roll"]._asdict()
    bends, overshoots = [], []
    for name in ("model-following", "first-order"):
        config = configured(name, 4.0, **shipped)
        found = flown(config, lag, dead_time, (-0.15, -0.2), (0.15, -0.2))
        bends.append(np.abs(found[:, 1] + 0.2).max())
        overshoots.append(found[:, 0].max() - 0.15)
    assert bends[0] < bends[1] <= 0.0035
    assert overshoots[0] <= overshoots[1] + 1e-4
