"""Standing, lifting off, touching down, tipping over."""

from math import acos, inf, isnan, nan, radians

import pytest

from sitl_mock.config.airframe import AirframeConfig, WindConfig
from sitl_mock.physics.quaternion import yaw
from sitl_mock.physics.vehicle import ActuatorCommand, Vehicle


def fly(vehicle, seconds, thrust, roll=0.0, armed=True):
    for _ in range(round(seconds * 1000)):
        vehicle.step(ActuatorCommand(armed, roll, 0.0, 0.0, thrust))
    return vehicle.truth


def tilt(q):
    """Angle between the body's and the world's down axis, rad."""
    return acos(min(1.0, 1.0 - 2.0 * (q[1] ** 2 + q[2] ** 2)))


def climbed(**options):
    vehicle = Vehicle(seed=0, **options)
    fly(vehicle, 2.0, 0.65)
    assert not vehicle.on_ground
    return vehicle


def land(vehicle, sink_thrust=0.42):
    for _ in range(20_000):
        vehicle.step(ActuatorCommand(True, 0.0, 0.0, 0.0, sink_thrust))
        if vehicle.on_ground:
            return vehicle.truth
    raise AssertionError("never came down")


@pytest.mark.parametrize(("armed", "thrust"), [(False, 1.0), (True, 0.0), (True, 0.45)])
def test_stands_still_with_too_little_thrust_even_in_a_storm(armed, thrust):
    vehicle = Vehicle(seed=0, heading=1.0, wind=WindConfig(speed_m_s=15.0, gust_m_s=3.0))
    truth = fly(vehicle, 1.0, thrust, roll=1.0, armed=armed)
    assert truth.on_ground
    assert not truth.crashed
    assert truth.position_ned == (0.0, 0.0, 0.0)
    assert truth.velocity_ned == truth.body_rates == truth.acceleration_ned == (0.0, 0.0, 0.0)
    assert yaw(truth.q) == pytest.approx(1.0)
    assert isnan(truth.touchdown_speed)


def test_lifts_off_when_thrust_exceeds_weight():
    vehicle = Vehicle(seed=0)
    fly(vehicle, 1.0, 0.48)
    assert vehicle.on_ground
    truth = fly(vehicle, 1.0, 0.52)
    assert not truth.on_ground
    assert truth.position_ned[2] < -0.05
    assert tilt(truth.q) < 1e-9


def test_hover_throttle_is_the_measured_one():
    vehicle = climbed()
    fly(vehicle, 8.0, 0.49)
    assert vehicle.truth.velocity_ned[2] == pytest.approx(0.0, abs=0.1)


def test_a_heavier_vehicle_of_the_same_specific_thrust_hovers_alike():
    vehicle = climbed(airframe=AirframeConfig(mass_kg=2.0, drag_n_s_per_m=2.0))
    fly(vehicle, 8.0, 0.49)
    assert vehicle.truth.velocity_ned[2] == pytest.approx(0.0, abs=0.1)


def test_an_emptier_battery_no_longer_carries_the_vehicle():
    vehicle = climbed()
    vehicle.set_battery_remaining(0.1)
    assert fly(vehicle, 2.0, 0.49).velocity_ned[2] > 1.0
    assert vehicle.battery.remaining == pytest.approx(0.1, abs=0.001)


@pytest.mark.parametrize("throttle", [0.15, 0.3, 0.75, 1.0])
def test_thrust_curve_is_the_measured_one(throttle):
    vehicle = climbed()
    truth = fly(vehicle, 0.5, throttle)
    airframe = AirframeConfig()
    # Along the vertical: T/m = g - a - drag v.
    specific = airframe.gravity_m_s2 - truth.acceleration_ned[2] - truth.velocity_ned[2]
    assert specific == pytest.approx(19.55 * throttle + 0.22, rel=0.015)


def test_soft_landing_records_its_speed_and_keeps_the_place():
    vehicle = climbed(heading=-2.0)
    truth = land(vehicle)
    assert 0.3 < truth.touchdown_speed < 2.0
    assert not truth.crashed
    assert truth.position_ned[2] == 0.0
    assert truth.velocity_ned == (0.0, 0.0, 0.0)
    place = truth.position_ned
    truth = fly(vehicle, 0.5, 0.0)
    assert truth.position_ned == place
    assert fly(vehicle, 1.0, 0.6).position_ned[2] < -0.1  # and it flies again


def tilted_above_ground(angle):
    """Leaning by `angle` (rad) about roll and pitch, with no rates left, sinking."""
    vehicle = climbed()
    while tilt(vehicle.truth.q) < angle:
        vehicle.step(ActuatorCommand(True, 0.8, 0.6, 0.0, 0.5))
    fly(vehicle, 0.3, 0.45)
    return vehicle


def test_the_landing_gear_levels_a_small_tilt_and_keeps_the_heading():
    vehicle = tilted_above_ground(radians(10.0))
    truth = land(vehicle)
    assert radians(8.0) < tilt(truth.q) < radians(20.0)
    heading = yaw(truth.q)
    truth = fly(vehicle, 1.0, 0.0)
    assert not truth.crashed
    assert tilt(truth.q) < 1e-6
    assert yaw(truth.q) == pytest.approx(heading, abs=0.05)


def test_touching_down_leaning_far_over_is_a_crash_for_good():
    vehicle = tilted_above_ground(radians(50.0))
    truth = land(vehicle, sink_thrust=0.5)
    assert truth.crashed
    assert truth.touchdown_speed < AirframeConfig().crash_speed_m_s
    lying = fly(vehicle, 2.0, 1.0)
    assert lying.on_ground
    assert lying.q == truth.q
    assert lying.throttles == (0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("thrust", [nan, 0.0, -1.0, -inf])
def test_no_thrust_is_free_fall_and_a_crash(thrust):
    vehicle = Vehicle(seed=0)
    fly(vehicle, 4.0, 0.7)
    falling = fly(vehicle, 0.5, thrust)
    airframe = AirframeConfig()
    expected = airframe.gravity_m_s2 - falling.velocity_ned[2]  # less drag, at 1 N/(m/s) and 1 kg
    assert falling.acceleration_ned[2] == pytest.approx(expected, abs=0.02)
    truth = land(vehicle, sink_thrust=thrust)
    assert truth.crashed
    assert truth.touchdown_speed > 5.0


@pytest.mark.parametrize("thrust", [1.5, inf])
def test_more_than_full_thrust_is_full(thrust):
    full, more = climbed(), climbed()
    assert fly(more, 0.5, thrust) == fly(full, 0.5, 1.0)


def test_disarmed_in_the_air_it_falls():
    vehicle = climbed()
    assert fly(vehicle, 0.5, 0.5, armed=False).acceleration_ned[2] > 5.0
