"""Body-rate responses of the whole vehicle against those measured on PX4."""

from math import inf, nan

import numpy as np
import pytest
from scipy.optimize import curve_fit

from sitl_mock.config.airframe import AirframeConfig
from sitl_mock.config.rate_loop import AxisGains, RateLoopConfig
from sitl_mock.config.sensors import SensorConfig
from sitl_mock.physics.multirotor import Multirotor
from sitl_mock.physics.rate_loop import axis_constants, axis_step
from sitl_mock.physics.vehicle import ActuatorCommand, Vehicle

NOISELESS = SensorConfig(
    attitude_noise_deg=0.0,
    rate_noise_rad_s=0.0,
    position_noise_m=0.0,
    velocity_noise_m_s=0.0,
    acceleration_noise_m_s2=0.0,
)
ROLL, PITCH, YAW = range(3)
HOVER = 0.49
REST = (0.0, 0.0, 0.0)
PERIOD = 4  # ms between telemetry samples
MEASURED_TILT = (19.6, 0.73, 0.0085, 1.0)  # wn [rad/s], zeta, dead time [s], gain
MEASURED_YAW = (5.6, 0.94, 0.045, 0.92)


def command(axis, rate, thrust=HOVER):
    rates = [0.0, 0.0, 0.0]
    rates[axis] = rate
    return ActuatorCommand(True, *rates, thrust)


def airborne(airframe=None, thrust=0.6):
    vehicle = Vehicle(airframe, sensors=NOISELESS, seed=0)
    for _ in range(2000):
        vehicle.step(command(YAW, 0.0, thrust=thrust))
    assert not vehicle.on_ground
    return vehicle


def response(axis, rate, seconds):
    """Times in s and body rates per setpoint, as telemetry would show them."""
    vehicle = airborne()
    samples = []
    for step in range(round(seconds * 1000) + 1):
        if step % PERIOD == 0:
            samples.append((step / 1000, vehicle.estimate().body_rates[axis] / rate))
        vehicle.step(command(axis, rate))
    return np.array(samples).T


def second_order(t, wn, zeta, dead_time, gain):
    s = np.maximum(t - dead_time, 0.0)
    wd = wn * np.sqrt(1.0 - zeta**2)
    ringing = np.cos(wd * s) + zeta * wn / wd * np.sin(wd * s)
    return gain * (1.0 - np.exp(-zeta * wn * s) * ringing)


def fitted(t, y, start):
    bounds = ([1.0, 0.2, 0.0, 0.5], [60.0, 0.999, 0.2, 1.2])
    return curve_fit(second_order, t, y, p0=start, bounds=bounds)[0]


def rms_from(t, y, parameters):
    return float(np.sqrt(np.mean((second_order(t, *parameters) - y) ** 2)))


@pytest.mark.parametrize("rate", [0.5, 1.0, 2.0, -1.0])
@pytest.mark.parametrize("axis", [ROLL, PITCH])
def test_roll_and_pitch_answer_as_measured(axis, rate):
    t, y = response(axis, rate, 1.0)
    wn, zeta, dead_time, gain = fitted(t, y, MEASURED_TILT)
    assert wn == pytest.approx(19.6, rel=0.05)
    assert zeta == pytest.approx(0.73, rel=0.06)
    assert dead_time == pytest.approx(0.0085, abs=0.002)
    assert gain == pytest.approx(1.0, abs=0.01)
    assert rms_from(t, y, MEASURED_TILT) < 0.01
    peak = int(np.argmax(y))
    assert 0.04 < y[peak] - 1.0 < 0.10
    assert t[peak] == pytest.approx(0.24, abs=0.015)
    assert np.interp(0.63, y[: peak + 1], t[: peak + 1]) == pytest.approx(0.10, abs=0.003)


@pytest.mark.parametrize("rate", [0.5, 1.0, 2.0, -1.0])
def test_yaw_answers_as_measured(rate):
    t, y = response(YAW, rate, 1.5)
    wn, zeta, dead_time, gain = fitted(t, y, MEASURED_YAW)
    assert wn == pytest.approx(5.6, rel=0.05)
    assert zeta == pytest.approx(0.94, rel=0.05)
    assert dead_time == pytest.approx(0.045, abs=0.008)
    assert gain == pytest.approx(0.92, abs=0.01)
    assert rms_from(t, y, MEASURED_YAW) < 0.01


def first_order(t, lag, dead_time):
    return 1.0 - np.exp(-np.maximum(t - dead_time, 0.0) / lag)


@pytest.mark.parametrize(("axis", "lag", "dead_time"), [(ROLL, 73, 54), (PITCH, 57, 46)])
def test_unlike_axes_answer_as_identified_on_px4(axis, lag, dead_time):
    """By a doublet, as `identify` flies it (SIH_MASS 1.2, SIH_IXX 0.04, SIH_IYY 0.03)."""
    airframe = AirframeConfig.model_validate("unlike-axes")
    hover = (airframe.gravity_m_s2 - airframe.thrust_offset_m_s2) / airframe.thrust_slope_m_s2
    assert hover == pytest.approx(0.59, abs=0.003)
    vehicle = airborne(airframe, thrust=0.7)
    times, parts = np.arange(1.6, step=PERIOD / 1e3), ((0.0, 1.05), (0.25, -2.1), (0.75, 2.1))
    rates = []
    for step in range(1600):
        if step % PERIOD == 0:
            rates.append(vehicle.estimate().body_rates[axis])
        now = step / 1000
        vehicle.step(command(axis, sum(size for at, size in parts if at <= now <= 1.0), hover))

    def doublet(t, lag, dead_time):
        late = (*parts, (1.0, -1.05))
        return sum(size * first_order(t - at, lag, dead_time) for at, size in late)

    fit = curve_fit(doublet, times, rates, p0=(0.06, 0.05))[0]
    assert fit == pytest.approx((lag / 1e3, dead_time / 1e3), abs=0.005)


def test_setpoints_are_not_clipped():
    vehicle = airborne()
    for _ in range(400):
        vehicle.step(command(ROLL, 20.0, thrust=0.7))
    assert vehicle.truth.body_rates[ROLL] > 15.0


@pytest.mark.parametrize("axis", [ROLL, PITCH, YAW])
@pytest.mark.parametrize("odd", [nan, inf, -inf])
def test_a_rate_that_is_no_number_holds_the_present_rate(axis, odd):
    vehicle = airborne()
    for _ in range(800):
        vehicle.step(command(axis, 0.8))
    before = vehicle.truth.body_rates
    for _ in range(300):
        vehicle.step(command(axis, odd))
    assert vehicle.truth.body_rates == pytest.approx(before, rel=0.2, abs=1e-6)
    for _ in range(1500):
        vehicle.step(command(axis, 0.0))
    assert vehicle.truth.body_rates == pytest.approx(REST, abs=0.01)


def test_a_setpoint_acts_only_after_its_delay():
    vehicle = airborne()
    delay = round(RateLoopConfig().roll.setpoint_delay_ms)
    for _ in range(delay):
        vehicle.step(command(ROLL, 1.0))
    level = vehicle.truth.throttles
    assert max(level) - min(level) < 1e-9
    vehicle.step(command(ROLL, 1.0))
    assert max(vehicle.truth.throttles) - min(vehicle.truth.throttles) > 0.1


def test_idling_forgets_the_integral_and_the_filtered_torque():
    """The vehicle idles its loop whenever it is disarmed or stands."""
    level = (1.0, 0.0, 0.0, 0.0)
    hovering = Multirotor(AirframeConfig(), RateLoopConfig(), level, 9.80665)

    def torques():
        return [torque for _, torque in hovering.actuation[2]]

    for _ in range(500):  # a body that is held still while it should turn
        hovering.drive((1.0, 1.0, 1.0), HOVER)
    for _ in range(10):  # longer than the delay
        hovering.drive(REST, HOVER)
    assert min(map(abs, torques())) > 1e-3  # wound up: torque without error
    hovering.drive(REST, HOVER, controlled=False)
    hovering.drive(REST, HOVER)
    assert torques() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("armed", [True, False])
def test_no_torque_is_stored_up_while_standing_or_disarmed(armed):
    vehicle, fresh = Vehicle(sensors=NOISELESS, seed=0), Vehicle(sensors=NOISELESS, seed=0)
    for _ in range(1000):
        vehicle.step(ActuatorCommand(armed, 2.0, -2.0, 2.0, 0.0))
        fresh.step(ActuatorCommand(False, 0.0, 0.0, 0.0, 0.0))
    for each in (vehicle, fresh):
        for _ in range(500):
            each.step(command(YAW, 0.0, thrust=0.6))
    assert vehicle.truth == fresh.truth


def test_the_integral_shrinks_but_does_not_grow_while_saturated():
    constants = axis_constants(AxisGains(proportional_n_m_s=0.1, integral_n_m=1.0), 1e-3)
    wound = axis_step(constants, (0.0, 0.0), 1.0, 0.0, 0.0, False, 1e-3)
    assert wound[0] == pytest.approx(1e-3)
    assert axis_step(constants, wound, 1.0, 0.0, 0.0, True, 1e-3)[0] == wound[0]
    assert axis_step(constants, wound, -1.0, 0.0, 0.0, True, 1e-3)[0] < wound[0]


def test_a_fall_without_thrust_stores_no_torque():
    """The rotors give nothing, so the integral may not grow on the error."""
    vehicle = airborne()
    for roll, steps in ((2.0, 400), (0.0, 20)):
        for _ in range(steps):
            vehicle.step(command(ROLL, roll, thrust=0.0))
    falling = vehicle.truth.body_rates[ROLL]
    rates = []
    for _ in range(300):
        vehicle.step(command(ROLL, 0.0, thrust=0.6))
        rates.append(abs(vehicle.truth.body_rates[ROLL] - falling))
    assert max(rates) < 0.1


def test_the_integral_has_a_limit():
    constants = axis_constants(
        AxisGains(proportional_n_m_s=0.0, integral_n_m=10.0, integral_limit_n_m=0.2), 1e-3
    )
    for sign in (1.0, -1.0):
        state = (0.0, 0.0)
        for _ in range(1000):
            state = axis_step(constants, state, sign, 0.0, 0.0, False, 1e-3)
        assert state[0] == sign * 0.2
