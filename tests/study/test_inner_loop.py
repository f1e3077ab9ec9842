"""The complete inner loop against ideal kinematics, and against Euler's equations by SciPy."""

from math import pi

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from companion.attitude import (
    BodyRates,
    Coefficients,
    InvalidQuaternionError,
    Limits,
    Target,
    attitude,
    make_planner,
)
from companion.study.inner_loop import InnerLoop
from sitl_mock.config.airframe import AirframeConfig
from sitl_mock.config.rate_loop import AxisGains, RateLoopConfig
from tests.attitude.independent import coefficients_of
from tests.attitude.simulate import fly as fly_ideally
from tests.attitude.simulate import rotation

LEVEL = (1.0, 0.0, 0.0, 0.0)
UPRIGHT = Target(0.0, 0.0, 0.0)
FIGURE_2 = Coefficients(-0.4, -0.5), Coefficients(0.4, -0.5)


class Asking:
    """Asks for one body rate throughout, and keeps what it was shown."""

    def __init__(self, *rates):
        self.asked = BodyRates(*rates)
        self.seen = []

    def rates(self, q, target, dt, body_rates=None):
        self.seen.append((q, dt, body_rates))
        return self.asked


def every_axis(**gains):
    axis = AxisGains(setpoint_delay_ms=0.0, **gains)
    return RateLoopConfig(roll=axis, pitch=axis, yaw=axis)


def path_of(flight):
    return np.array([coefficients_of(rotation(q)) for q in flight.q])


def fly(planner=None, loop=None, seconds=0.2, rate_hz=1000, start=LEVEL, target=UPRIGHT):
    planner = planner or make_planner("first-order")
    return (loop or InnerLoop()).fly(planner, start, target, seconds=seconds, rate_hz=rate_hz)


def test_at_its_target_the_vehicle_stays_whatever_the_tilt():
    c, psi = Coefficients(0.3, -0.5), 1.2
    flight = fly(start=attitude(c, psi), target=Target(*c, psi))
    assert np.abs(flight.body_rates).max() < 1e-9
    assert path_of(flight) == pytest.approx(np.tile(c, (201, 1)), abs=1e-9)


def distance_from_ideal(lag_ms, name):
    """Largest distance from the ideal response with a rate loop of time constant 4·`lag_ms`."""
    inertia = 1e-4
    airframe = AirframeConfig(
        physics_rate_hz=5000,
        inertia_kg_m2=(inertia, inertia, 2 * inertia),
        rotational_drag_n_m_s=0.0,
        rotor_lag_ms=lag_ms,
        rotor_drag_ratio_m=0.2,
    )
    rate_loop = every_axis(proportional_n_m_s=inertia / (4e-3 * lag_ms))
    start, goal = FIGURE_2
    planner, q, target = make_planner(name), attitude(start, 0.4), Target(*goal, 0.4)
    flight = fly(planner, InnerLoop(airframe, rate_loop), 0.6, 1000, q, target)
    ideal, _, _ = fly_ideally(planner, rotation(q), target, 0.6, 1e-3)
    return np.hypot(*(path_of(flight) - ideal).T).max()


@pytest.mark.parametrize("name", ["first-order", "exact", "quaternion"])
def test_a_stiff_and_quick_rate_loop_comes_to_the_ideal_kinematics(name):
    """The distance is the lag times the speed, so it goes to nothing as the lag does."""
    slow, quick = distance_from_ideal(2.0, name), distance_from_ideal(0.5, name)
    assert quick < 0.01
    assert slow / quick == pytest.approx(4.0, rel=0.15)


INERTIA = np.array([0.015, 0.03, 0.045])
DAMPING, LAG = 0.025, 0.05
PROPORTIONAL, INTEGRAL, FEED_FORWARD, RATE_DAMPING = 0.3, 0.2, 0.02, 0.004


def euler_equations(asked, gyroscopic):
    """PI with feed-forward and damping, rotor lag, damping by the air, rigid body; continuous."""

    def rate(_, state):
        q, omega, integral, torque = state[:4], state[4:7], state[7:10], state[10:]
        moment = torque - DAMPING * omega
        if gyroscopic:
            moment = moment - np.cross(omega, INERTIA * omega)
        turning = moment / INERTIA
        error = asked - omega
        wanted = PROPORTIONAL * error + integral + FEED_FORWARD * asked - RATE_DAMPING * turning
        q_rate = 0.5 * np.concatenate(([-q[1:] @ omega], q[0] * omega + np.cross(q[1:], omega)))
        return np.concatenate((q_rate, turning, INTEGRAL * error, (wanted - torque) / LAG))

    return rate


def test_rolling_while_yawing_pitches_as_euler_says():
    airframe = AirframeConfig(
        physics_rate_hz=10000,
        inertia_kg_m2=tuple(INERTIA),
        rotational_drag_n_m_s=DAMPING,
        rotor_lag_ms=LAG * 1e3,
        rotor_drag_ratio_m=0.15,
    )
    rate_loop = every_axis(
        proportional_n_m_s=PROPORTIONAL,
        integral_n_m=INTEGRAL,
        feed_forward_n_m_s=FEED_FORWARD,
        damping_n_m_s2=RATE_DAMPING,
    )
    asked = (1.5, 0.0, 2.0)
    flight = fly(Asking(*asked), InnerLoop(airframe, rate_loop), 0.5, 100)

    begin = np.concatenate((LEVEL, np.zeros(9)))
    with_gyro, without = (
        solve_ivp(
            euler_equations(np.array(asked), gyroscopic),
            (0.0, 0.5),
            begin,
            t_eval=np.linspace(0.0, 0.5, 51),
            rtol=1e-9,
            atol=1e-11,
        ).y
        for gyroscopic in (True, False)
    )
    assert flight.body_rates == pytest.approx(with_gyro[4:7].T, abs=2e-3)
    flown, expected = (Rotation.from_quat(q[:, [1, 2, 3, 0]]) for q in (flight.q, with_gyro[:4].T))
    apart = flown.inv() * expected
    assert apart.magnitude().max() < 1e-3
    pitch = flight.body_rates[:, 1]
    assert np.abs(pitch - without[5]).max() > 0.1  # pitch was not asked for: gyroscopic alone
    assert np.abs(without[5]).max() == 0.0


def test_an_absurd_command_saturates_the_rotors_and_their_torque_bounds_the_turn():
    airframe = AirframeConfig()
    flight = fly(Asking(500.0, 0.0, 500.0), seconds=0.1)
    # All thrust on one side at full allocation, half the throttle range each way.
    most = 0.5 * airframe.rotor_arm_m * airframe.mass_kg * airframe.thrust_slope_m_s2
    assert 0.0 < np.diff(flight.body_rates[:, 0]).max() * 1000 < most / airframe.inertia_kg_m2[0]


def test_a_tilted_vehicle_saturates_at_another_command_than_a_level_one():
    """The thrust that holds height leaves less room above: at 60° there is none for yaw."""
    steep = attitude(Coefficients(0.0, 0.85), 0.0)
    level, tilted = (
        fly(Asking(0.0, 0.0, 0.5), start=start).body_rates[-1, 2] for start in (LEVEL, steep)
    )
    assert 0.0 < tilted < 0.9 * level


@pytest.mark.parametrize(("delay", "steps"), [(0.020, 20), (0.0034, 3), (0.0036, 4)])
def test_the_transport_delay_shifts_the_response_by_just_that(delay, steps):
    planner = Asking(1.0, -0.5, 0.3)
    prompt = fly(planner).body_rates
    late = fly(planner, InnerLoop(transport_delay=delay)).body_rates
    assert np.abs(late[: steps + 1]).max() < 1e-12
    assert late[steps:] == pytest.approx(prompt[:-steps], abs=1e-9)
    assert np.abs(late[steps:-1] - prompt[1:-steps]).max() > 1e-3  # a step more would show


def test_without_any_delay_the_first_step_answers():
    loop = InnerLoop(rate_loop=every_axis(proportional_n_m_s=0.4))
    first = fly(Asking(1.0, 0.0, 0.0), loop, seconds=0.001).body_rates[-1, 0]
    # Torque of the mean of a rotor's thrust over its first step, dt/2 of the lag of 50 ms.
    assert first == pytest.approx(0.4 / 0.025 * 1e-3 * (0.5 / 50), rel=0.02)


def test_the_planner_sees_the_vehicle_at_its_own_rate_and_is_held_between():
    planner = Asking(0.4, 0.2, 0.0)
    flight = fly(planner, seconds=0.5, rate_hz=50.0)
    assert len(planner.seen) == 25
    attitudes, periods, body_rates = zip(*planner.seen, strict=True)
    assert set(periods) == {0.02}
    assert np.array(attitudes) == pytest.approx(flight.q[:-1], abs=0)
    assert np.array(body_rates) == pytest.approx(flight.body_rates[:-1], abs=0)
    assert len(flight.q) == 26
    assert flight.commanded_rates.tolist() == [[0.4, 0.2, 0.0]] * 25
    # The command is constant: how often it is repeated changes the thrust a little, no torque.
    assert flight.body_rates == pytest.approx(fly(planner, seconds=0.5).body_rates[::20], abs=1e-9)


def test_the_same_flight_twice_is_the_same_to_the_last_bit():
    start, goal = FIGURE_2
    planner = make_planner("first-order", limits=Limits(max_tilt_rate=pi / 2))
    q, target = attitude(start, 2.0), Target(*goal, 2.0)
    first, second = (fly(planner, None, 0.3, 250, q, target) for _ in range(2))
    for one, other in ((first.q, second.q), (first.commanded_rates, second.commanded_rates)):
        np.testing.assert_array_equal(one, other)


def test_the_rate_loop_takes_a_tenth_of_a_second_as_measured_on_px4():
    assert InnerLoop().rate_time_to_63_percent() == pytest.approx(0.10, abs=0.006)
    assert InnerLoop(transport_delay=0.02).rate_time_to_63_percent() == pytest.approx(
        InnerLoop().rate_time_to_63_percent() + 0.02, abs=1e-6
    )


def test_a_loop_of_one_lag_takes_its_time_constant():
    """P alone on a body with hardly any lag below: inertia over gain, closed form."""
    airframe = AirframeConfig(physics_rate_hz=10000, rotational_drag_n_m_s=0.0, rotor_lag_ms=0.05)
    loop = InnerLoop(airframe, every_axis(proportional_n_m_s=0.25))
    assert loop.rate_time_to_63_percent() == pytest.approx(0.025 / 0.25, rel=2e-3)


def test_a_start_that_is_no_attitude_is_refused():
    with pytest.raises(InvalidQuaternionError):
        fly(start=(1.0, 1.0, 0.0, 0.0))
