"""What goes into the configuration, and what is kept out of it; and the thrust map."""

from dataclasses import replace

import numpy as np
import pytest
import yaml
from rich.console import Console

from companion.config import Config
from companion.config.files import changed
from companion.identification import (
    BadFitError,
    FitQuality,
    IdentifiedVehicle,
    RateResponse,
    SecondOrderFit,
    ThrustMap,
    fit_thrust_map,
    identify_vehicle,
    vehicle_fragment,
    vehicle_table,
)

from .vehicles import Doublets, lag_with_dead_time, regular

GRAVITY = 9.80665
GOOD = FitQuality(
    explained=0.99,
    misfit=0.08,
    dead_time_error=0.001,
    lag_error=0.002,
    span=2.0,
    excited_samples=200,
)
ROLL = RateResponse(0.040, 0.046, 1.05, None, GOOD)
PITCH = RateResponse(0.042, 0.049, 1.02, None, GOOD)
YAW = RateResponse(0.102, 0.370, 0.92, None, GOOD)
MAP = ThrustMap(19.55, 0.22, 0.05, 0.01, 0.99)
POOR_MAP = ThrustMap(6.0, 7.0, 0.0, 0.0, 0.47)
VEHICLE = IdentifiedVehicle(ROLL, PITCH, YAW, MAP)


IN_FORCE = {
    "roll": (18.0, 19.0, 1100.0, None),
    "pitch": (17.0, 19.0, 1000.0, None),
    "yaw": (60.0, 158.0, 270.0, None),
}


def configured(vehicle, known=None):
    text = vehicle_fragment(vehicle, GRAVITY, known or {})
    return Config.model_validate(yaml.safe_load(text))


def bad(response):
    return replace(response, fit=replace(GOOD, misfit=0.4))


def test_the_configuration_takes_it():
    config = configured(VEHICLE)
    vehicle = config.vehicle
    assert (vehicle.lag_ms, vehicle.dead_time_ms) == (47.5, 41.0)
    assert (vehicle.yaw_lag_ms, vehicle.yaw_dead_time_ms) == (370.0, 102.0)
    assert (vehicle.pitch_lag_ms, vehicle.pitch_dead_time_ms) == (None, None)  # as roll
    assert vehicle.yaw_frame_lead_ms is None  # it follows from the times of the axes
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


def test_an_axis_without_a_slew_limit_does_not_inherit_that_of_roll():
    vehicle = configured(replace(VEHICLE, roll=replace(ROLL, slew=19.4)))
    limits = {name: axis.acceleration_limit_deg_s2 for name, axis in vehicle.vehicle.axes.items()}
    assert limits == {
        "roll": pytest.approx(np.degrees(19.4), abs=0.5),
        "pitch": 100_000.0,
        "yaw": 100_000.0,
    }


def test_pitch_is_written_where_it_differs_from_roll():
    vehicle = configured(replace(VEHICLE, pitch=replace(PITCH, dead_time=0.044))).vehicle
    assert (vehicle.lag_ms, vehicle.dead_time_ms) == (46.0, 40.0)
    assert (vehicle.pitch_lag_ms, vehicle.pitch_dead_time_ms) == (49.0, 44.0)
    slower = replace(VEHICLE, roll=replace(ROLL, slew=19.0), pitch=replace(PITCH, slew=16.0))
    axes = configured(slower).vehicle.axes
    assert axes["roll"].acceleration_limit_deg_s2 == pytest.approx(np.degrees(19.0), abs=0.5)
    assert axes["pitch"].acceleration_limit_deg_s2 == pytest.approx(np.degrees(16.0), abs=0.5)


QUALITY = 0.02, 0.0003, 0.0004, 2.0, 500
"""Misfit, standard errors of dead time and lag (s), span of the commands, excited samples."""
NEARER = SecondOrderFit(20.0, 0.75, 0.0084, 1.05, None, FitQuality(0.998, *QUALITY))
SECOND_ORDER = replace(
    VEHICLE, roll=replace(ROLL, second_order=NEARER), pitch=replace(PITCH, second_order=NEARER)
)


def test_a_second_order_that_is_nearer_on_roll_and_pitch_is_written():
    axes = configured(SECOND_ORDER).vehicle.axes
    assert axes["roll"] == axes["pitch"] == (75.0, 8.4, None, 0.75)
    assert axes["yaw"] == (370.0, 102.0, None, None)
    slower = replace(SECOND_ORDER.pitch, second_order=replace(NEARER, frequency=15.0))
    axes = configured(replace(SECOND_ORDER, pitch=slower)).vehicle.axes
    assert axes["roll"].lag_ms == 75.0
    assert axes["pitch"] == (100.0, 8.4, None, 0.75)
    damped = replace(SECOND_ORDER.pitch, second_order=replace(NEARER, damping=0.78, frequency=20.8))
    assert configured(replace(SECOND_ORDER, pitch=damped)).vehicle.damping == 0.77


@pytest.mark.parametrize(
    "pitch",
    [
        PITCH,
        bad(SECOND_ORDER.pitch),
        replace(PITCH, second_order=replace(NEARER, slew=9.0)),
        replace(PITCH, second_order=replace(NEARER, damping=0.2)),
    ],
)
def test_a_second_order_of_one_axis_or_with_a_slew_limit_is_not_written(pitch):
    known = {"pitch": (49.0, 42.0, None, None)}
    axes = configured(replace(SECOND_ORDER, pitch=pitch), known).vehicle.axes
    assert axes["roll"].damping is axes["pitch"].damping is None


def test_a_second_order_is_not_written_where_it_is_not_wanted():
    text = vehicle_fragment(SECOND_ORDER, GRAVITY, {}, allow_second_order=False)
    assert Config.model_validate(yaml.safe_load(text)).vehicle.axes["roll"].damping is None
    assert "clearly better: second order" in text


def test_a_configured_second_order_is_kept_where_the_fit_is_bad():
    known = {"roll": (74.5, 8.5, None, 0.73)}
    axes = configured(replace(VEHICLE, roll=bad(ROLL)), known).vehicle.axes
    assert axes["roll"] == (74.5, 8.5, None, 0.73)
    assert axes["pitch"] == (49.0, 42.0, None, None)


def test_nothing_of_another_vehicles_file_remains_in_force():
    other = Config.model_validate(
        {
            "vehicle": {
                "lag_ms": 75.0,
                "dead_time_ms": 8.0,
                "damping": 0.73,
                "acceleration_limit_deg_s2": 1100.0,
                "pitch_lag_ms": 60.0,
                "pitch_dead_time_ms": 9.0,
                "pitch_damping": 0.6,
                "yaw_lag_ms": 60.0,
                "yaw_acceleration_limit_deg_s2": 270.0,
            }
        }
    )
    keys = yaml.safe_load(vehicle_fragment(VEHICLE, GRAVITY, {}))
    assert changed(other, keys, "test").vehicle.axes == configured(VEHICLE).vehicle.axes


def test_an_axis_with_a_bad_fit_keeps_what_the_configuration_knows_and_says_so():
    vehicle = replace(VEHICLE, yaw=bad(YAW))
    axes = configured(vehicle, IN_FORCE).vehicle.axes
    assert axes["yaw"] == (60.0, 158.0, 270.0, None)
    assert axes["roll"][:2] == (47.5, 41.0)
    assert (
        "# yaw: kept from the configuration: lag 60.0 ms, dead time 158.0 ms, slew 270 °/s²; "
        "the fit is bad: poor fit: the model's error is 40% of the rates' standard deviation"
    ) in vehicle_fragment(vehicle, GRAVITY, IN_FORCE)
    axes = configured(replace(VEHICLE, pitch=bad(PITCH)), IN_FORCE).vehicle.axes
    assert axes["pitch"] == (17.0, 19.0, 1000.0, None)
    assert axes["roll"][:2] == (46.0, 40.0)


@pytest.mark.parametrize(
    "known", [{}, {"yaw": (None, None, None, None)}, {"yaw": (370.0, None, None, None)}]
)
def test_an_axis_of_which_nothing_is_known_is_not_left_to_roll(known):
    with pytest.raises(BadFitError, match=r"^yaw: poor fit"):
        vehicle_fragment(replace(VEHICLE, yaw=bad(YAW)), GRAVITY, known)


def test_each_axis_says_how_good_it_is():
    nearer = SecondOrderFit(19.4, 0.72, 0.008, 1.02, None, FitQuality(0.998, *QUALITY))
    text = vehicle_fragment(
        replace(VEHICLE, pitch=replace(PITCH, slew=19.2, second_order=nearer)), GRAVITY, {}
    )
    assert (
        "# roll, first order: lag 46.0 ± 2.0 ms, dead time 40.0 ± 1.0 ms, gain 1.05, "
        "explains 99.0% of the variance, misfit 8%"
    ) in text
    assert "slew 19.2 rad/s²" in text
    assert (
        "clearly better: second order, natural frequency 19.4 rad/s, damping ratio 0.72, "
        "dead time 8 ms, explains 99.8%"
    ) in text
    assert "# thrust: T/m = 19.55·u +0.22 m/s²" in text


@pytest.mark.parametrize("thrust", [None, POOR_MAP, replace(MAP, slope=9.0), replace(MAP, lag=0.6)])
def test_a_thrust_map_that_is_missing_or_poor_is_left_out(thrust):
    assert "thrust" not in vehicle_fragment(replace(VEHICLE, thrust=thrust), GRAVITY, {})


def test_bad_fits_of_all_axes_are_refused_with_every_reason():
    still = replace(YAW, fit=replace(GOOD, span=0.01))
    nothing_good = IdentifiedVehicle(bad(ROLL), bad(PITCH), still, MAP)
    with pytest.raises(BadFitError, match=r"^roll: poor fit.*; yaw: too little excitation"):
        vehicle_fragment(nothing_good, GRAVITY, IN_FORCE)


def shown(vehicle):
    console = Console(width=80, record=True, file=open("/dev/null", "w", encoding="utf-8"))  # noqa: PTH123, SIM115
    console.print(vehicle_table(vehicle, GRAVITY))
    return console.export_text()


def test_the_table_tells_every_axis_within_80_columns():
    nearer = SecondOrderFit(5.6, 0.94, 0.045, 0.92, 4.8, FitQuality(0.9991, *QUALITY))
    text = shown(replace(VEHICLE, yaw=replace(YAW, slew=4.71239, second_order=nearer)))
    rows = {line.split("│")[1].strip(): line for line in text.splitlines() if "│" in line}
    assert [cell.strip() for cell in rows["roll"].split("│")[2:8]] == [
        "46.0 ± 2.0",
        "40.0 ± 1.0",
        "1.05",
        "–",
        "8%",
        "good",
    ]
    assert " 270 " in rows["yaw"]
    flat = " ".join(text.split())
    assert "roll: a lag of first order explains 99.0% of the variance; second order is not" in flat
    assert "yaw: written as first order" in flat
    assert "a better fit: second order, natural frequency 5.6 rad/s" in flat
    assert "T/m = 19.55·u +0.22" in text
    assert "hovers at 0.490" in " ".join(text.split())
    assert max(map(len, text.splitlines())) <= 80


def test_the_table_shows_what_the_file_holds():
    text = shown(SECOND_ORDER)
    rows = {line.split("│")[1].strip(): line for line in text.splitlines() if "│" in line}
    assert [cell.strip() for cell in rows["roll"].split("│")[2:8]] == [
        *("75.0 ± 0.4", "8.4 ± 0.3", "0.75", "1.05", "2%", "good"),
    ]
    assert rows["yaw"].split("│")[4].strip() == "–"
    model_line = (
        "roll: second order, which explains 99.8% of the variance; first order explains 99.0%"
    )
    assert model_line in " ".join(text.split())
    assert "slew" not in text  # no axis has one
    axes = configured(SECOND_ORDER).vehicle.axes
    assert axes["roll"][:2] == (75.0, 8.4)
    assert max(map(len, text.splitlines())) <= 80


def test_the_table_tells_what_is_bad_or_missing():
    nothing = identify_vehicle([], [], [])
    text = shown(nothing)
    assert text.count("bad") == 3
    assert "thrust: not measured, or never changed" in text
    assert "explains only 47%" in shown(replace(VEHICLE, thrust=POOR_MAP))


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
    assert found.flaw(GRAVITY) is None


def test_vibration_in_a_long_hover_does_not_hide_the_thrust_map():
    times = regular(40.0, 50)
    moves = (times > 30.0) & (times < 33.0)
    thrust = 0.49 + 0.1 * moves * np.sign(np.sin(7.0 * times))
    specific = 0.22 + lag_with_dead_time(times, thrust, 0.03, 0.01, gain=19.55)
    noisy = specific + np.random.default_rng(0).normal(0.0, 0.6, times.size)
    found = fit_thrust_map(times, thrust, times, noisy)
    assert found.slope == pytest.approx(19.55, rel=0.05)
    assert found.flaw(GRAVITY) is None


def test_thrust_that_never_changed_gives_no_map():
    times = regular(3.0, 100)
    assert fit_thrust_map(times, np.full(300, 0.5), times, np.full(300, 9.8)) is None
