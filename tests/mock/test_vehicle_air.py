"""Wind statistics and battery sag."""

from math import exp

import numpy as np
import pytest

from sitl_mock.config.airframe import AirframeConfig, BatteryConfig, WindConfig
from sitl_mock.physics.battery import Battery
from sitl_mock.physics.environment import Wind

STEP = 0.01
HOVER_N = 9.80665


def gusts(config, seed=1, steps=200_000):
    wind = Wind(config, STEP, seed)
    out = np.empty((steps, 3))
    for row in out:
        row[:] = wind.velocity
        wind.step()
    return out


def test_mean_wind_blows_from_where_it_says():
    wind = Wind(WindConfig(speed_m_s=5.0, from_deg=90.0), STEP, seed=3)
    wind.step()
    assert wind.velocity == pytest.approx((0.0, -5.0, 0.0), abs=1e-12)


def test_gusts_have_the_configured_mean_spread_and_memory():
    config = WindConfig(
        speed_m_s=4.0, from_deg=180.0, gust_m_s=1.5, vertical_gust_m_s=0.6, gust_time_s=0.5
    )
    air = gusts(config)  # 2000 s: 4000 correlation times
    np.testing.assert_allclose(air.mean(axis=0), (4.0, 0.0, 0.0), atol=0.15)
    np.testing.assert_allclose(air.std(axis=0), (1.5, 1.5, 0.6), rtol=0.06)
    for axis in range(3):
        gust = air[:, axis] - air[:, axis].mean()
        lag = round(config.gust_time_s / STEP)
        memory = np.mean(gust[lag:] * gust[:-lag]) / np.var(gust)
        assert memory == pytest.approx(exp(-1.0), abs=0.06)
    assert abs(np.corrcoef(air[:, 0], air[:, 1])[0, 1]) < 0.06


def test_the_first_gust_is_drawn_from_the_same_spread():
    config = WindConfig(gust_m_s=2.0, vertical_gust_m_s=0.5)
    first = [Wind(config, STEP, seed).velocity for seed in range(2000)]
    np.testing.assert_allclose(np.std(first, axis=0), (2.0, 2.0, 0.5), rtol=0.08)


def test_gusts_depend_on_the_seed_alone():
    config = WindConfig(gust_m_s=1.0)
    np.testing.assert_array_equal(gusts(config, 5, 100), gusts(config, 5, 100))
    assert not np.array_equal(gusts(config, 5, 100), gusts(config, 6, 100))


def test_a_full_pack_in_a_hover_gives_full_thrust():
    battery = Battery(BatteryConfig(), AirframeConfig())
    battery.step(HOVER_N, STEP)
    assert battery.thrust_factor == pytest.approx(1.0, abs=1e-5)
    assert battery.state.current_a == pytest.approx(10.5)
    assert battery.state.voltage_v == pytest.approx(4 * 4.2 - 10.5 * 0.005, abs=1e-3)


def test_charge_is_the_integral_of_the_current():
    config = BatteryConfig(capacity_ah=1.0, idle_current_a=0.0, hover_current_a=6.0)
    battery = Battery(config, AirframeConfig())
    for _ in range(6000):  # a minute at 6 A = 0.1 Ah
        battery.step(HOVER_N, STEP)
    assert battery.state.remaining == pytest.approx(0.9)


def test_voltage_and_thrust_fall_with_current_and_with_charge():
    battery = Battery(BatteryConfig(), AirframeConfig())
    battery.step(HOVER_N, STEP)
    hover, factor = battery.state, battery.thrust_factor
    battery.step(2 * HOVER_N, STEP)
    assert battery.state.current_a == pytest.approx(0.5 + 10.0 * 2**1.5)
    assert battery.state.voltage_v < hover.voltage_v
    assert battery.thrust_factor < factor
    battery.set_remaining(0.1)
    battery.step(HOVER_N, STEP)
    assert battery.state.voltage_v == pytest.approx(4 * 3.66 - 10.5 * 0.005, abs=1e-3)
    assert battery.thrust_factor == pytest.approx((14.5875 / 16.7475) ** 2, rel=1e-3)


def test_an_empty_pack_stays_empty():
    battery = Battery(BatteryConfig(), AirframeConfig())
    battery.set_remaining(-3.0)
    battery.step(HOVER_N, 10.0)
    assert battery.state.remaining == 0.0
    battery.set_remaining(7.0)
    assert battery.state.remaining == 1.0
