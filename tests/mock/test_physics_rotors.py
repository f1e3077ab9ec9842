"""Allocation, thrust curve and lag of the rotors."""

from math import exp

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_mock.config.airframe import AirframeConfig
from sitl_mock.physics.rotors import (
    allocate,
    rotor_constants,
    rotor_step,
    steady_thrust,
    throttle_of,
)

AIRFRAME = AirframeConfig()
ROTORS = rotor_constants(AIRFRAME, 1e-3)
STILL = (0.0, 0.0, 0.0, 0.0)
difference = st.floats(-0.6, 0.6)
SIGNS = ((-1, 1, 1), (1, -1, 1), (1, 1, -1), (-1, -1, -1))


def parts(throttles):
    """Collective and roll, pitch, yaw differences contained in four throttles."""
    return (
        sum(throttles) / 4,
        *(sum(s[i] * u for s, u in zip(SIGNS, throttles, strict=True)) / 4 for i in range(3)),
    )


@settings(max_examples=400, derandomize=True)
@given(st.floats(0.0, 1.5), difference, difference, difference)
def test_throttles_stay_possible_and_no_axis_turns_the_wrong_way(throttle, roll, pitch, yaw):
    result = allocate(throttle, roll, pitch, yaw)
    assert all(-1e-12 <= u <= 1.0 + 1e-12 for u in result.throttles)
    got = parts(result.throttles)
    assert got[0] <= throttle + 1e-12  # thrust gives way downwards only
    for given_back, asked in zip(got[1:], (roll, pitch, yaw), strict=True):
        assert abs(given_back) <= abs(asked) + 1e-12
        assert given_back * asked >= -1e-12


@settings(derandomize=True)
@given(st.floats(0.4, 0.6), *[st.floats(-0.1, 0.1)] * 3)
def test_what_fits_is_given_exactly(throttle, roll, pitch, yaw):
    result = allocate(throttle, roll, pitch, yaw)
    assert not result.tilt_saturated
    assert not result.yaw_saturated
    assert parts(result.throttles) == pytest.approx((throttle, roll, pitch, yaw), abs=1e-12)


def test_roll_and_pitch_go_before_yaw_and_before_thrust():
    full = allocate(1.0, 0.2, 0.1, 0.5)
    assert parts(full.throttles) == pytest.approx((0.7, 0.2, 0.1, 0.2), abs=1e-12)
    assert (full.tilt_saturated, full.yaw_saturated) == (False, True)
    left = allocate(0.3, 0.15, -0.15, -0.2)
    assert parts(left.throttles) == pytest.approx((0.3, 0.15, -0.15, 0.0), abs=1e-12)
    cut = allocate(0.1, 0.3, -0.1, 0.0)
    assert parts(cut.throttles) == pytest.approx((0.1, 0.075, -0.025, 0.0), abs=1e-12)
    assert cut.tilt_saturated


def test_nothing_turns_at_throttle_zero():
    assert allocate(0.0, 1.0, 1.0, 1.0).throttles == (0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("axis", "throttles"),
    [(1, (0.4, 0.6, 0.6, 0.4)), (2, (0.6, 0.4, 0.6, 0.4)), (3, (0.6, 0.6, 0.4, 0.4))],
)
def test_torque_signs_follow_from_where_the_rotors_sit(axis, throttles):
    """More thrust left: roll right. More in front: nose up. More counter-clockwise: nose right."""
    thrusts = STILL
    for _ in range(2000):
        thrusts, load = rotor_step(ROTORS, thrusts, throttles, 1.0)
    assert load[axis] > 0.0
    assert [load[i] for i in (1, 2, 3) if i != axis] == pytest.approx([0.0, 0.0], abs=1e-12)


@pytest.mark.parametrize("throttle", [0.15, 0.3, 0.49, 0.75, 1.0])
def test_steady_thrust_is_the_measured_line(throttle):
    total = 4 * steady_thrust(ROTORS, throttle)
    assert total / AIRFRAME.mass_kg == pytest.approx(19.55 * throttle + 0.22)


def test_thrust_below_the_line_falls_to_zero_without_a_jump():
    below = AIRFRAME.thrust_linear_from - 1e-9
    above = steady_thrust(ROTORS, below + 2e-9)
    assert steady_thrust(ROTORS, below) == pytest.approx(above, abs=1e-7)
    assert steady_thrust(ROTORS, 0.0) == 0.0


@pytest.mark.parametrize("throttle", [0.0, 0.1, 0.15, 0.49, 1.0])
def test_the_throttle_for_a_thrust_settles_at_that_thrust(throttle):
    thrust = steady_thrust(ROTORS, throttle)
    assert throttle_of(ROTORS, thrust) == pytest.approx(throttle, abs=1e-12)


def test_lag_is_first_order_whatever_the_step():
    for dt in (1e-3, 1e-4):
        rotors, thrusts = rotor_constants(AIRFRAME, dt), STILL
        for _ in range(round(0.05 / dt)):
            thrusts, _ = rotor_step(rotors, thrusts, (0.5,) * 4, 0.9)
        expected = 0.9 * steady_thrust(rotors, 0.5) * (1.0 - exp(-1.0))
        assert thrusts == pytest.approx((expected,) * 4, rel=1e-9)


def test_the_step_gives_the_mean_of_before_and_after():
    thrusts, load = rotor_step(ROTORS, STILL, (1.0,) * 4, 1.0)
    assert load[0] == pytest.approx(0.5 * sum(thrusts))
