"""ArduCopter's thrust: the measured table, the boost, the climb rate."""

from itertools import pairwise
from math import cos, inf, nan, radians

import pytest

from sitl_mock.ardupilot.defaults import AIRFRAME
from sitl_mock.ardupilot.hold import ClimbProfile, approach_speed
from sitl_mock.ardupilot.thrust import (
    angle_boosted_thrust,
    climb_rate_of_setpoint,
    specific_thrust,
    thrust_of_setpoint,
)
from sitl_mock.config.airframe import AirframeConfig
from sitl_mock.physics.rigid_body import GRAVITY, advance, body_of
from sitl_mock.physics.rotors import rotor_constants, throttle_of

CLIMBS = {0.2: 0.57, 0.3: 0.82, 0.36: 0.99, 0.4: 1.09, 0.5: 1.33, 0.6: 1.58, 0.8: 2.03, 1.0: 2.30}
"""Normalised thrust -> measured upward acceleration from a hover, plus gravity, in g."""


@pytest.mark.parametrize(("thrust", "g"), CLIMBS.items())
def test_climbs_accelerate_as_measured_with_the_drag_that_they_meet(thrust, g):
    body, load = body_of(AirframeConfig(**AIRFRAME)), (specific_thrust(thrust), *(0.0,) * 6)
    motion = (0.0, 0.0, 0.0, 1.0, *(0.0,) * 6)
    climbs = []
    for _ in range(600):
        motion, _ = advance(motion, load, body, 1e-3)
        climbs.append(-motion[2])
    mean = (climbs[599] - climbs[199]) / 0.4
    assert 1.0 + mean / GRAVITY == pytest.approx(g, rel=0.06)


def test_more_thrust_always_gives_more_and_0_364_hovers():
    values = [specific_thrust(0.01 * step) for step in range(101)]
    assert all(high > low for low, high in pairwise(values))
    assert specific_thrust(0.364) == pytest.approx(GRAVITY)


def test_the_airframe_can_give_all_of_it():
    rotors = rotor_constants(AirframeConfig(**AIRFRAME), 1e-3)
    share = throttle_of(rotors, 0.25 * specific_thrust(1.0))
    assert share == pytest.approx(1.0)
    assert throttle_of(rotors, 0.25 * specific_thrust(0.8)) < 0.95


@pytest.mark.parametrize(
    ("asked", "thrust"), [(0.4, 0.4), (nan, 0.0), (inf, 1.0), (-1.0, 0.0), (1.5, 1.0)]
)
def test_odd_thrusts(asked, thrust):
    assert thrust_of_setpoint(asked) == thrust


@pytest.mark.parametrize(
    ("asked", "climb"), [(0.5, 0.0), (1.0, 2.5), (0.0, -1.5), (0.75, 1.25), (nan, 0.0), (inf, 2.5)]
)
def test_thrust_as_a_climb_rate(asked, climb):
    assert climb_rate_of_setpoint(asked, 2.5, 1.5) == climb


def test_the_boost_divides_by_the_cosine_of_the_tilt_and_ends_upside_down():
    assert angle_boosted_thrust(0.364, cos(radians(25.0))) * cos(radians(25.0)) == pytest.approx(
        0.364
    )
    assert angle_boosted_thrust(0.364, 0.0) == angle_boosted_thrust(0.364, -0.5) == 0.0


def test_a_climb_gathers_speed_no_faster_than_its_limit():
    climb = ClimbProfile()
    climb.begin(3.0, -0.5)
    for _ in range(100):
        climb.step(2.0, 1.0, 0.01)
    assert climb.rate == pytest.approx(0.5)
    assert climb.height == pytest.approx(3.0, abs=0.01)


def test_an_approach_can_still_stop():
    assert approach_speed(2.0, 1.0, 10.0) ** 2 / 2.0 == pytest.approx(2.0)
    assert approach_speed(100.0, 1.0, 2.5) == 2.5
    assert approach_speed(-1.0, 1.0, 2.5) == 0.0
