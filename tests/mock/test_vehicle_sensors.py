"""What the estimate says against the truth: noise, delay, resets; and determinism."""

from math import radians
from random import Random

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.spatial.transform import Rotation

from sitl_mock.config.airframe import AirframeConfig, BatteryConfig, WindConfig
from sitl_mock.config.rate_loop import RateLoopConfig
from sitl_mock.config.sensors import SensorConfig
from sitl_mock.physics.quaternion import yaw
from sitl_mock.physics.sensors import white_noise
from sitl_mock.physics.vehicle import ActuatorCommand, Vehicle

PERFECT = {
    "attitude_noise_deg": 0.0,
    "rate_noise_rad_s": 0.0,
    "position_noise_m": 0.0,
    "velocity_noise_m_s": 0.0,
    "acceleration_noise_m_s2": 0.0,
    "attitude_delay_ms": 0.0,
    "rate_lag_ms": 0.0,
    "position_delay_ms": 0.0,
}
TURNING = ActuatorCommand(True, 0.6, -0.4, 0.5, 0.62)


def sensing(**changes):
    return SensorConfig(**(PERFECT | changes))


def airborne(sensors=None, seed=0, **options):
    vehicle = Vehicle(sensors=sensors, seed=seed, **options)
    for _ in range(1500):
        vehicle.step(ActuatorCommand(True, 0.0, 0.0, 0.0, 0.6))
    for _ in range(300):
        vehicle.step(TURNING)
    return vehicle


def test_perfect_sensors_tell_the_truth():
    vehicle = airborne(sensing())
    estimate, truth = vehicle.estimate(), vehicle.truth
    assert estimate.q == pytest.approx(truth.q)
    assert estimate.body_rates == truth.body_rates
    assert estimate.position_ned == truth.position_ned
    assert estimate.velocity_ned == truth.velocity_ned


def test_specific_force_is_what_an_accelerometer_feels():
    vehicle = airborne(sensing())
    truth = vehicle.truth
    w, x, y, z = truth.q
    rotation = Rotation.from_quat([x, y, z, w])
    felt = np.subtract(truth.acceleration_ned, (0.0, 0.0, 9.80665))
    np.testing.assert_allclose(vehicle.estimate().specific_force_frd, rotation.inv().apply(felt))
    assert Vehicle(sensors=sensing(), seed=0).estimate().specific_force_frd == (0.0, 0.0, -9.80665)


def test_delays_show_the_past():
    vehicle = airborne(sensing(attitude_delay_ms=5.0, rate_lag_ms=4.0, position_delay_ms=20.0))
    history = [vehicle.truth]
    for _ in range(40):
        vehicle.step(TURNING)
        history.append(vehicle.truth)
    estimate = vehicle.estimate()
    assert estimate.q == pytest.approx(history[-6].q)
    assert estimate.body_rates == history[-10].body_rates
    assert estimate.position_ned == history[-21].position_ned
    assert estimate.velocity_ned == history[-21].velocity_ned


def test_the_white_noise_is_that_of_random_gauss():
    uniform, judge = Random("3/sensors"), Random("3/sensors")
    numbers, deviations = [uniform.random() for _ in range(30)], (0.0, 0.1, 2.0)
    white_noise(numbers, deviations)
    assert numbers == [judge.gauss(0.0, deviations[index % 3]) for index in range(30)]


def test_noise_has_the_configured_spread():
    sensors = SensorConfig(
        attitude_noise_deg=0.5,
        rate_noise_rad_s=0.03,
        position_noise_m=0.2,
        velocity_noise_m_s=0.1,
        acceleration_noise_m_s2=0.4,
    )
    vehicle = Vehicle(sensors=sensors, seed=4)
    drawn = [vehicle.estimate() for _ in range(4000)]

    def spread(values):
        return np.std(np.array(values), axis=0)

    turns = [Rotation.from_quat([e.q[1], e.q[2], e.q[3], e.q[0]]).as_rotvec() for e in drawn]
    np.testing.assert_allclose(spread(turns), radians(0.5), rtol=0.06)
    np.testing.assert_allclose(spread([e.body_rates for e in drawn]), 0.03, rtol=0.06)
    np.testing.assert_allclose(spread([e.position_ned for e in drawn]), 0.2, rtol=0.06)
    np.testing.assert_allclose(spread([e.velocity_ned for e in drawn]), 0.1, rtol=0.06)
    np.testing.assert_allclose(spread([e.specific_force_frd for e in drawn]), 0.4, rtol=0.06)
    assert np.mean([e.specific_force_frd for e in drawn], axis=0)[2] == pytest.approx(-9.8, abs=0.1)


def test_an_estimator_reset_moves_the_estimate_and_not_the_vehicle():
    vehicle, other = airborne(sensing(), heading=0.3), airborne(sensing(), heading=0.3)
    before = vehicle.estimate()
    vehicle.estimator.shift(yaw=0.5, position_ned=(1.0, -2.0, 0.25))
    after = vehicle.estimate()
    assert vehicle.estimator.reset_counter == 1
    assert np.subtract(after.position_ned, before.position_ned) == pytest.approx((1.0, -2.0, 0.25))
    assert yaw(after.q) - yaw(before.q) == pytest.approx(0.5)
    assert after.velocity_ned == before.velocity_ned
    assert after.specific_force_frd == before.specific_force_frd
    vehicle.estimator.shift(yaw=-0.5, position_ned=(1.0, 1.0, 1.0))
    again = vehicle.estimate()
    assert again.q == pytest.approx(before.q)
    assert np.subtract(again.position_ned, before.position_ned) == pytest.approx((2.0, -1.0, 1.25))
    assert vehicle.estimator.reset_counter == 2
    vehicle.step(TURNING)
    other.step(TURNING)
    assert vehicle.truth == other.truth


def test_a_flight_is_a_function_of_the_seed():
    gusty = {"wind": WindConfig(gust_m_s=1.0)}
    first, again, other = (airborne(seed=seed, **gusty) for seed in (7, 7, 8))
    assert first.truth == again.truth
    assert first.estimate() == again.estimate()
    assert first.truth != other.truth


def test_estimating_draws_sensor_noise_and_nothing_else():
    gusty = {"wind": WindConfig(gust_m_s=1.0)}
    asked, quiet = airborne(**gusty), airborne(**gusty)
    assert asked.estimate() != asked.estimate()
    quiet.estimate()
    quiet.estimate()
    for _ in range(50):
        asked.step(TURNING)
        asked.truth  # noqa: B018 - looking changes nothing either
        quiet.step(TURNING)
    assert asked.truth == quiet.truth
    assert asked.estimate() == quiet.estimate()


@pytest.mark.parametrize("rate_hz", [1000, 2500])
def test_time_is_the_count_of_steps(rate_hz):
    vehicle = Vehicle(AirframeConfig(physics_rate_hz=rate_hz), seed=0)
    for step in range(1, 701):
        vehicle.step(ActuatorCommand(False, 0.0, 0.0, 0.0, 0.0))
        assert vehicle.time == step / rate_hz
    assert vehicle.plant.constants.multirotor.rate_loop.dt == 1 / rate_hz


def test_the_step_does_not_change_the_flight():
    coarse, fine = (
        Vehicle(AirframeConfig(physics_rate_hz=rate), sensors=sensing(), seed=0)
        for rate in (1000, 4000)
    )
    for vehicle in (coarse, fine):
        for second in (ActuatorCommand(True, 0.0, 0.0, 0.0, 0.6), TURNING):
            vehicle.step(second, round(1.0 / vehicle.plant.constants.multirotor.rate_loop.dt))
    assert coarse.truth.position_ned == pytest.approx(fine.truth.position_ned, abs=5e-3)
    assert coarse.truth.q == pytest.approx(fine.truth.q, abs=2e-3)


@pytest.mark.parametrize(
    ("section", "values"),
    [
        (AirframeConfig, {"mass": 1.0}),
        (AirframeConfig, {"mass_kg": 0.0}),
        (AirframeConfig, {"physics_rate_hz": 500}),
        (AirframeConfig, {"inertia_kg_m2": (0.1, float("nan"), 0.1)}),
        (WindConfig, {"gust_m_s": -1.0}),
        (BatteryConfig, {"initial_remaining": 1.5}),
        (SensorConfig, {"attitude_delay_ms": float("inf")}),
        (RateLoopConfig, {"roll": {"proportional": 1.0}}),
    ],
)
def test_impossible_configuration_is_refused(section, values):
    with pytest.raises(ValidationError):
        section(**values)
