"""Braking: a smooth way to rest, checked by finite differences."""

from math import hypot

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.guidance import VehicleMotion
from companion.guidance.braking import Braking

HERE, BEGUN, HEADING = (3.0, -2.0, -5.0), 100.0, 0.7
SPEEDS = st.floats(-10.0, 10.0)


@given(st.tuples(SPEEDS, SPEEDS, SPEEDS), st.floats(0.5, 8.0))
def test_it_is_smooth_and_ends_where_the_vehicle_is_at_rest(velocity, deceleration):
    braking = Braking(BEGUN, VehicleMotion(HERE, velocity), HEADING, deceleration)
    speed, h = hypot(*velocity), 1e-5
    assert braking.at(braking.ends + 5.0).position_ned == pytest.approx(braking.stop)
    assert braking.at(braking.ends + 5.0).velocity_ned == pytest.approx((0.0,) * 3)
    if speed < 0.1:
        assert braking.stop == HERE
        return
    assert braking.at(BEGUN)[:2] == (HERE, velocity)
    for time in np.linspace(BEGUN + 0.01, braking.ends - 0.01, 7):
        before, now, after = (braking.at(time + k * h) for k in (-1.0, 0.0, 1.0))
        moved = np.subtract(after.position_ned, before.position_ned) / (2.0 * h)
        assert moved == pytest.approx(now.velocity_ned, abs=1e-5)
        sped = np.subtract(after.velocity_ned, before.velocity_ned) / (2.0 * h)
        assert sped == pytest.approx(now.acceleration_ned, abs=1e-4)
        assert hypot(*now.acceleration_ned) <= 1.5 * deceleration + 1e-9
        assert now.heading == HEADING


@pytest.mark.parametrize(("speed", "deceleration"), [(8.0, 2.5), (5.0, 2.5), (20.0, 3.0)])
def test_a_fast_vehicle_stops_within_the_distance_that_the_fence_assumes(speed, deceleration):
    braking = Braking(BEGUN, VehicleMotion(HERE, (0.0, speed, 0.0)), HEADING, deceleration)
    assert braking.stop[1] - HERE[1] == pytest.approx(speed**2 / (2.0 * deceleration), rel=0.05)
