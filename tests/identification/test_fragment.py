"""What goes into the configuration, and what is kept out of it; and the thrust map."""

import numpy as np
import pytest
import yaml

from companion.config import Config
from companion.identification import (
    BadFitError,
    FitQuality,
    RateResponse,
    ThrustMap,
    fit_thrust_map,
    vehicle_fragment,
)

from .vehicles import lag_with_dead_time, regular

GOOD = FitQuality(0.99, 0.001, 0.002, 2.0, 200)
ROLL = RateResponse(0.040, 0.046, 1.05, None, GOOD)
PITCH = RateResponse(0.042, 0.050, 1.02, 19.2, GOOD)
YAW = RateResponse(0.102, 0.370, 0.92, None, GOOD)


def test_the_configuration_takes_it():
    vehicle = Config.model_validate(yaml.safe_load(vehicle_fragment(ROLL, PITCH, YAW))).vehicle
    assert (vehicle.lag_ms, vehicle.dead_time_ms) == (48.0, 41.0)
    assert (vehicle.yaw_lag_ms, vehicle.yaw_dead_time_ms) == (370.0, 102.0)


def test_each_axis_says_how_good_it_is():
    text = vehicle_fragment(ROLL, PITCH, YAW, ThrustMap(19.55, 0.22, 0.05, 0.01, 0.99))
    assert "# roll: lag 46.0 ± 2.0 ms, dead time 40.0 ± 1.0 ms, gain 1.05, explains 99.0%" in text
    assert "slew 19.2 rad/s²" in text
    assert "# thrust: T/m = 19.55·u +0.22 m/s²" in text


def test_a_bad_thrust_map_is_not_mentioned():
    assert "thrust" not in vehicle_fragment(ROLL, PITCH, YAW, ThrustMap(6.0, 7.0, 0.0, 0.0, 0.47))


def test_bad_fits_are_refused_with_every_reason():
    poor = RateResponse(0.04, 0.05, 1.0, None, FitQuality(0.4, 0.001, 0.002, 2.0, 200))
    still = RateResponse(0.04, 0.05, 1.0, None, FitQuality(0.99, 0.001, 0.002, 0.01, 200))
    with pytest.raises(BadFitError, match=r"^roll: poor fit.*; yaw: too little excitation"):
        vehicle_fragment(poor, PITCH, still)


def test_the_thrust_map_comes_back_through_the_rotors_lag():
    times = regular(8.0, 100)
    thrust = 0.49 + 0.08 * np.sign(np.sin(4.0 * times))
    specific = 0.22 + lag_with_dead_time(times, thrust, 0.05, 0.012, gain=19.55)
    noisy = specific + np.random.default_rng(0).normal(0.0, 0.07, times.size)
    found = fit_thrust_map(times, thrust, times, noisy)
    assert found.slope == pytest.approx(19.55, rel=0.02)
    assert found.offset == pytest.approx(0.22, abs=0.15)
    assert found.lag == pytest.approx(0.05, abs=0.005)
    assert found.is_good()


def test_thrust_that_never_changed_gives_no_map():
    times = regular(3.0, 100)
    assert fit_thrust_map(times, np.full(300, 0.5), times, np.full(300, 9.8)) is None
