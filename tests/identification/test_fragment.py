"""What goes into the configuration, and what is kept out of it; and the thrust map."""

from dataclasses import replace

import numpy as np
import pytest
import yaml
from rich.console import Console

from companion.config import Config
from companion.identification import (
    BadFitError,
    FitQuality,
    IdentifiedVehicle,
    RateResponse,
    ThrustMap,
    fit_thrust_map,
    identify_vehicle,
    vehicle_fragment,
    vehicle_table,
)

from .vehicles import Doublets, lag_with_dead_time, regular

GRAVITY = 9.80665
GOOD = FitQuality(0.99, 0.001, 0.002, 2.0, 200)
ROLL = RateResponse(0.040, 0.046, 1.05, None, GOOD)
PITCH = RateResponse(0.042, 0.050, 1.02, None, GOOD)
YAW = RateResponse(0.102, 0.370, 0.92, None, GOOD)
MAP = ThrustMap(19.55, 0.22, 0.05, 0.01, 0.99)
POOR_MAP = ThrustMap(6.0, 7.0, 0.0, 0.0, 0.47)
VEHICLE = IdentifiedVehicle(ROLL, PITCH, YAW, MAP)


def configured(vehicle):
    return Config.model_validate(yaml.safe_load(vehicle_fragment(vehicle, GRAVITY)))


def test_the_configuration_takes_it():
    config = configured(VEHICLE)
    vehicle = config.vehicle
    assert (vehicle.lag_ms, vehicle.dead_time_ms) == (48.0, 41.0)
    assert (vehicle.yaw_lag_ms, vehicle.yaw_dead_time_ms) == (370.0, 102.0)
    assert vehicle.acceleration_limit_deg_s2 is None
    assert vehicle.yaw_acceleration_limit_deg_s2 is None
    assert config.thrust.hover_thrust == pytest.approx((GRAVITY - 0.22) / 19.55, abs=5e-4)


def test_a_slew_limit_is_taken_where_one_was_found():
    limited = replace(
        VEHICLE,
        roll=replace(ROLL, slew=19.0),
        pitch=replace(PITCH, slew=19.4),
        yaw=replace(YAW, slew=4.7),
    )
    vehicle = configured(limited).vehicle
    assert vehicle.acceleration_limit_deg_s2 == pytest.approx(np.degrees(19.2), abs=0.5)
    assert vehicle.yaw_acceleration_limit_deg_s2 == pytest.approx(np.degrees(4.7), abs=0.5)
    on_one_axis = configured(replace(VEHICLE, pitch=replace(PITCH, slew=19.4))).vehicle
    assert on_one_axis.acceleration_limit_deg_s2 == pytest.approx(np.degrees(19.4), abs=0.5)


def test_each_axis_says_how_good_it_is():
    text = vehicle_fragment(replace(VEHICLE, pitch=replace(PITCH, slew=19.2)), GRAVITY)
    assert "# roll: lag 46.0 ± 2.0 ms, dead time 40.0 ± 1.0 ms, gain 1.05, explains 99.0%" in text
    assert "slew 19.2 rad/s²" in text
    assert "# Acceleration is limited, as by ArduPilot: keep `vehicle.yaw_frame_lead_ms`" in text
    assert "yaw_frame_lead_ms" not in vehicle_fragment(VEHICLE, GRAVITY)
    assert "# thrust: T/m = 19.55·u +0.22 m/s²" in text


@pytest.mark.parametrize("thrust", [None, POOR_MAP, replace(MAP, slope=9.0), replace(MAP, lag=0.6)])
def test_a_thrust_map_that_is_missing_or_poor_is_left_out(thrust):
    assert "thrust" not in vehicle_fragment(replace(VEHICLE, thrust=thrust), GRAVITY)


def test_bad_fits_are_refused_with_every_reason():
    poor = RateResponse(0.04, 0.05, 1.0, None, FitQuality(0.4, 0.001, 0.002, 2.0, 200))
    still = RateResponse(0.04, 0.05, 1.0, None, FitQuality(0.99, 0.001, 0.002, 0.01, 200))
    with pytest.raises(BadFitError, match=r"^roll: poor fit.*; yaw: too little excitation"):
        vehicle_fragment(IdentifiedVehicle(poor, PITCH, still, MAP), GRAVITY)


def shown(vehicle):
    console = Console(width=80, record=True, file=open("/dev/null", "w", encoding="utf-8"))  # noqa: PTH123, SIM115
    console.print(vehicle_table(vehicle, GRAVITY))
    return console.export_text()


def test_the_table_tells_every_axis_within_80_columns():
    text = shown(replace(VEHICLE, yaw=replace(YAW, slew=4.71239)))
    rows = {line.split("│")[1].strip(): line for line in text.splitlines() if "│" in line}
    assert [cell.strip() for cell in rows["roll"].split("│")[2:8]] == [
        "46.0 ± 2.0",
        "40.0 ± 1.0",
        "1.05",
        "–",
        "99.0%",
        "good",
    ]
    assert " 270 " in rows["yaw"]
    assert "T/m = 19.55·u +0.22" in text
    assert "hovers at 0.490" in " ".join(text.split())
    assert max(map(len, text.splitlines())) <= 80


def test_the_table_tells_what_is_bad_or_missing():
    nothing = identify_vehicle([], [], [])
    text = shown(nothing)
    assert text.count("bad") == 3
    assert "thrust: not measured, or never changed" in text
    assert "explains 47%" in shown(replace(VEHICLE, thrust=POOR_MAP))


def test_a_vehicle_is_identified_axis_by_axis_for_a_gain_of_one():
    times = regular(Doublets().end, 100)
    asked = Doublets().at(times)
    axes = [(0.03, 0.02, 1.0), (0.05, 0.04, 1.0), (0.1, 0.06, 0.9)]
    measured = [lag_with_dead_time(times, asked, lag, dead, gain=g) for lag, dead, g in axes]
    setpoints = np.column_stack((times, asked, asked, asked, np.full(times.size, 0.5)))
    rates = np.column_stack((times, *measured))
    vehicle = identify_vehicle(setpoints.tolist(), rates.tolist(), [])
    for response, (lag, dead_time, _) in zip((vehicle.roll, vehicle.pitch), axes, strict=False):
        assert response.lag == pytest.approx(lag, rel=0.03)
        assert response.dead_time == pytest.approx(dead_time, abs=0.001)
    assert vehicle.yaw.gain == pytest.approx(0.9, abs=0.01)  # told, though 1 was assumed
    assert vehicle.yaw.lag > 0.105  # what the gain lacks is made up for by lag
    assert vehicle.thrust is None


def test_the_thrust_map_comes_back_through_the_rotors_lag():
    times = regular(8.0, 100)
    thrust = 0.49 + 0.08 * np.sign(np.sin(4.0 * times))
    specific = 0.22 + lag_with_dead_time(times, thrust, 0.05, 0.012, gain=19.55)
    noisy = specific + np.random.default_rng(0).normal(0.0, 0.07, times.size)
    found = fit_thrust_map(times, thrust, times, noisy)
    assert found.slope == pytest.approx(19.55, rel=0.02)
    assert found.offset == pytest.approx(0.22, abs=0.15)
    assert found.lag == pytest.approx(0.05, abs=0.005)
    assert found.normalised(9.80665) == pytest.approx(0.490, abs=0.003)
    assert found.is_good(GRAVITY)


def test_vibration_in_a_long_hover_does_not_hide_the_thrust_map():
    times = regular(40.0, 50)
    moves = (times > 30.0) & (times < 33.0)
    thrust = 0.49 + 0.1 * moves * np.sign(np.sin(7.0 * times))
    specific = 0.22 + lag_with_dead_time(times, thrust, 0.03, 0.01, gain=19.55)
    noisy = specific + np.random.default_rng(0).normal(0.0, 0.6, times.size)
    found = fit_thrust_map(times, thrust, times, noisy)
    assert found.slope == pytest.approx(19.55, rel=0.05)
    assert found.is_good(GRAVITY)


def test_thrust_that_never_changed_gives_no_map():
    times = regular(3.0, 100)
    assert fit_thrust_map(times, np.full(300, 0.5), times, np.full(300, 9.8)) is None
