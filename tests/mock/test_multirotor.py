"""The multirotor by itself: how it begins, hovers, and what stops its rotors."""

from math import nan

import pytest

from sitl_mock.config.airframe import AirframeConfig
from sitl_mock.config.rate_loop import RateLoopConfig
from sitl_mock.physics.multirotor import Multirotor
from sitl_mock.physics.multirotor_step import does_not_rise

AIRFRAME = AirframeConfig(drag_n_s_per_m=0.0)
LEVEL = (1.0, 0.0, 0.0, 0.0)
REST = (0.0, 0.0, 0.0)


def multirotor(specific_thrust=0.0):
    return Multirotor(AIRFRAME, RateLoopConfig(), LEVEL, specific_thrust)


def test_it_begins_with_its_rotors_turning_steadily():
    hovering = multirotor(AIRFRAME.gravity_m_s2)
    assert sum(hovering.actuation[1]) == pytest.approx(AIRFRAME.mass_kg * AIRFRAME.gravity_m_s2)
    throttle = hovering.throttle(AIRFRAME.gravity_m_s2)
    assert hovering.actuation[0].throttles == (throttle,) * 4
    for _ in range(1000):
        hovering.move(hovering.drive(REST, throttle))
    assert hovering.body[0] == pytest.approx((*REST, *LEVEL, *REST), abs=1e-12)


def test_without_thrust_it_falls():
    falling = multirotor()
    fallen = sum(falling.move(falling.drive(REST, 0.0))[2] for _ in range(1000))
    assert fallen == pytest.approx(AIRFRAME.gravity_m_s2 / 2)
    assert falling.body[1] == pytest.approx((0.0, 0.0, AIRFRAME.gravity_m_s2))


def test_more_thrust_than_there_is_is_full_throttle():
    assert multirotor().throttle(100.0) == 1.0


@pytest.mark.parametrize("factor", [0.9, 1.1])
def test_it_sinks_below_its_weight_and_lifts_above(factor):
    standing = multirotor(factor * AIRFRAME.gravity_m_s2)
    load = standing.drive(REST, standing.throttle(factor * AIRFRAME.gravity_m_s2))
    assert does_not_rise(standing.constants, standing.body, load) == (factor < 1.0)


@pytest.mark.parametrize("throttle", [nan, 0.0, -1.0])
def test_a_throttle_that_is_none_stops_the_rotors(throttle):
    hovering = multirotor(AIRFRAME.gravity_m_s2)
    hovering.drive((3.0, 0.0, 0.0), throttle)
    assert hovering.actuation[0].throttles == (0.0,) * 4
    assert hovering.actuation[0].tilt_saturated


def test_uncontrolled_the_rotors_give_no_torque():
    idle = multirotor(AIRFRAME.gravity_m_s2)
    for _ in range(100):
        load = idle.drive((3.0, -3.0, 1.0), 0.5, controlled=False)
    assert load[1:4] == pytest.approx(REST, abs=1e-15)
