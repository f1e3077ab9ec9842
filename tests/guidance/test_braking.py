"""Braking: a smooth way to rest, checked by finite differences."""

from math import hypot

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from companion.guidance import VehicleMotion
from companion.guidance.braking import (
    AssumedBraking,
    Braking,
    acceleration_beside_wind,
    brake,
    brake_upwind,
    braking_time,
    handover_drift,
    mean_deceleration,
)

HERE, BEGUN, HEADING = (3.0, -2.0, -5.0), 100.0, 0.7
SPEEDS = st.floats(-10.0, 10.0)


@given(st.tuples(SPEEDS, SPEEDS, SPEEDS), st.floats(0.2, 8.0))
def test_it_is_smooth_and_ends_where_the_vehicle_is_at_rest(velocity, duration):
    braking, h = Braking(BEGUN, VehicleMotion(HERE, velocity), HEADING, duration), 1e-5
    assert braking.at(braking.end_time + 5.0).position_ned == pytest.approx(braking.stopping_point)
    assert braking.at(braking.end_time + 5.0).velocity_ned == pytest.approx((0.0,) * 3)
    assert braking.stopping_point[2] == HERE[2], "the height at which it began is held"
    assert braking.at(BEGUN)[:2] == (HERE, (*velocity[:2], 0.0))
    for time in np.linspace(BEGUN + 0.01, braking.end_time - 0.01, 7):
        before, now, after = (braking.at(time + k * h) for k in (-1.0, 0.0, 1.0))
        moved = np.subtract(after.position_ned, before.position_ned) / (2.0 * h)
        assert moved == pytest.approx(now.velocity_ned, abs=1e-4)
        sped = np.subtract(after.velocity_ned, before.velocity_ned) / (2.0 * h)
        assert sped == pytest.approx(now.acceleration_ned, abs=1e-3)
        assert hypot(*now.acceleration_ned) <= 1.5 * hypot(*velocity[:2]) / duration + 1e-9
        assert now.heading == HEADING


@given(
    speed=st.floats(0.1, 15.0),
    acceleration=st.floats(1.0, 10.0),
    reaction_time=st.floats(0.0, 2.0),
    deceleration=st.floats(0.5, 10.0),
)
def test_it_stops_within_what_the_monitor_of_the_fence_assumes(
    speed, acceleration, reaction_time, deceleration
):
    duration = braking_time(speed, acceleration, AssumedBraking(reaction_time, deceleration))
    braking = Braking(BEGUN, VehicleMotion(HERE, (0.0, speed, 0.0)), HEADING, duration)
    mean = mean_deceleration(deceleration, acceleration)
    assumed = speed * max(0.0, reaction_time - 0.1) + speed**2 / (2.0 * mean)
    assert 0.0 < braking.stopping_point[1] - HERE[1] <= assumed + 1e-9


def test_a_vehicle_at_rest_is_held_where_it_is():
    duration = braking_time(0.05, 5.0, AssumedBraking(0.3, 2.5))
    assert duration == 0.0
    braking = Braking(BEGUN, VehicleMotion(HERE, (0.05, 0.0, 0.0)), HEADING, duration)
    assert braking.at(BEGUN + 1.0).position_ned == HERE


@given(speed=st.floats(0.5, 15.0), acceleration=st.floats(0.3, 10.0))
def test_no_stop_needs_more_than_the_largest_acceleration(speed, acceleration):
    duration = braking_time(speed, acceleration, AssumedBraking(0.1, 20.0))
    braking = Braking(BEGUN, VehicleMotion(HERE, (0.0, speed, 0.0)), HEADING, duration)
    peak = max(-braking.at(BEGUN + duration * k / 100).acceleration_ned[1] for k in range(101))
    assert peak <= acceleration * 1.001


@given(
    largest=st.floats(1.0, 8.0),
    velocity=st.tuples(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0)),
    wind=st.tuples(st.floats(-6.0, 6.0), st.floats(-6.0, 6.0)),
)
def test_beside_the_wind_the_tilt_leaves_what_a_search_over_its_directions_finds(
    largest, velocity, wind
):
    """The search: of all accelerations by tilt, those that leave none across the motion."""
    speed = hypot(*velocity)
    assume(speed > 0.1)
    along, across = np.array(velocity) / speed, np.array((-velocity[1], velocity[0])) / speed
    angles = np.linspace(0.0, 2.0 * np.pi, 20001)
    sums = largest * np.column_stack((np.cos(angles), np.sin(angles))) + wind
    straight = np.abs(sums @ across) < 2.0 * largest * np.pi / 20000
    assume(straight.any())
    found = max(np.max(-(sums @ along)[straight]), 0.3)
    assert acceleration_beside_wind(largest, velocity, wind) == pytest.approx(found, abs=0.05)


def test_at_rest_the_wind_counts_as_if_the_vehicle_moved_along_it():
    assert acceleration_beside_wind(5.0, (0.0, 0.0), (3.0, 0.0)) == 2.0


@pytest.mark.parametrize("velocity", [(3.0, 4.0, -2.0), (5.0, 0.0, 1.0), (0.0, -5.0, 0.0)])
def test_the_braking_that_begins_now_is_as_long_as_the_horizontal_speed_needs(velocity):
    motion, assumed = VehicleMotion((1.0, 2.0, -9.0), velocity), AssumedBraking(0.3, 2.5)
    found = brake(7.0, motion, 0.4, 6.0, assumed)
    assert found == Braking(7.0, motion, 0.4, braking_time(5.0, 6.0, assumed))
    assert found.duration > 0.0


WIND = st.floats(-6.0, 6.0)


@given(st.tuples(SPEEDS, SPEEDS), st.tuples(WIND, WIND), st.floats(0.0, 3.0))
def test_a_move_upwind_is_smooth_and_the_drift_takes_it_back(velocity, wind, later):
    braking = Braking(BEGUN, VehicleMotion(HERE, (*velocity, 0.0)), HEADING, 2.0)
    moving, h, begun = brake_upwind(BEGUN + later, braking, wind), 1e-4, BEGUN + later
    assert moving.at(begun) == braking.at(begun)
    ends = moving.at(moving.end_time + 5.0)
    assert (ends.position_ned, ends.heading) == (pytest.approx(moving.stopping_point), HEADING)
    assert (*ends.velocity_ned, *ends.acceleration_ned) == pytest.approx((0.0,) * 6)
    back = np.add(moving.stopping_point[:2], handover_drift(wind))
    assert back == pytest.approx(braking.stopping_point[:2])
    for time in np.linspace(begun + 0.01, moving.end_time + 0.5, 7):
        before, now, after = (moving.at(time + k * h) for k in (-1.0, 0.0, 1.0))
        moved = np.subtract(after.position_ned, before.position_ned) / (2.0 * h)
        assert moved == pytest.approx(now.velocity_ned, abs=1e-3)
        sped = np.subtract(after.velocity_ned, before.velocity_ned) / (2.0 * h)
        assert sped == pytest.approx(now.acceleration_ned, abs=0.05)
        added = np.subtract(now.acceleration_ned, braking.at(time).acceleration_ned)
        assert hypot(*added) <= 1.5 + 1e-6


def test_without_wind_it_is_the_same_braking():
    braking = Braking(BEGUN, VehicleMotion(HERE, (1.0, 0.0, 0.0)), HEADING, 2.0)
    assert brake_upwind(BEGUN, braking, (0.0, 0.0)) is braking
