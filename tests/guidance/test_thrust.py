"""Specific thrust for a wanted acceleration: with the tilt there is and will be, height first."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from companion.attitude import BodyRates
from companion.guidance import GRAVITY
from companion.guidance.thrust import (
    TILT_THRUST_SHARE,
    acceleration_within_thrust,
    largest_tilt,
    predicted_cos_tilt,
    specific_thrust,
)

SMALLEST, LARGEST = 2.0, 18.0
accelerations = st.floats(-30.0, 30.0)
rates = st.floats(-3.0, 3.0)


def turned(rotation):
    x, y, z, w = rotation.as_quat()
    return float(w), float(x), float(y), float(z)


def cosine(rotation):
    return rotation.as_matrix()[2, 2]


def test_thrust_grows_with_tilt_and_never_without_end():
    assert specific_thrust(0.0, 1.0) == pytest.approx(GRAVITY)
    assert specific_thrust(0.0, math.cos(0.6)) * math.cos(0.6) == pytest.approx(GRAVITY)
    assert specific_thrust(0.0, 0.5 - 1e-9) == pytest.approx(specific_thrust(0.0, 0.5))
    assert specific_thrust(0.0, 0.25) == pytest.approx(GRAVITY)
    assert specific_thrust(0.0, 0.0) == specific_thrust(0.0, -1.0) == 0.0
    assert specific_thrust(20.0, 1.0) == 0.0


@pytest.mark.parametrize(
    ("lift", "tilt"),
    [
        (9.5, math.acos(0.5)),  # 95 % of 20 m/s² are 19
        (-3.0, math.pi / 2.0),  # it falls faster than freely, and needs no lift
        (19.0, 0.0),
        (25.0, 0.0),
    ],
)
def test_the_largest_tilt_is_that_at_which_the_lift_takes_95_percent_of_the_thrust(lift, tilt):
    assert largest_tilt(lift, 20.0) == pytest.approx(tilt)


@given(st.tuples(*[st.floats(-1.0, 1.0)] * 3), st.tuples(rates, rates, rates))
def test_the_tilt_ahead_is_that_of_a_vehicle_which_rotates_on(start, body_rates):
    now = Rotation.from_rotvec(start)
    ahead = 1e-4
    later = now * Rotation.from_rotvec(ahead * np.array(body_rates))
    found = predicted_cos_tilt(turned(now), BodyRates(*body_rates), ahead)
    assert found == pytest.approx(cosine(later), abs=1e-6)


def test_the_tilt_ahead_stays_a_cosine():
    q = turned(Rotation.from_rotvec((0.5, 0.0, 0.0)))
    assert predicted_cos_tilt(q, BodyRates(-100.0, 0.0, 0.0), 0.1) == 1.0
    fallen = turned(Rotation.from_rotvec((1.1, 0.0, 0.0)))
    assert predicted_cos_tilt(fallen, BodyRates(100.0, 0.0, 0.0), 0.1) == -1.0


@given(st.floats(0.0, 1.0), st.floats(0.0, 20.0), st.floats(0.0, 1.0))
def test_a_quick_rotation_never_reduces_the_thrust_of_a_vehicle_that_tilts(tilt, rate, lag):
    """With a long lag it seemed to fall over, and was let fall."""
    q = turned(Rotation.from_rotvec((0.0, -tilt, 0.0)))
    thrust = specific_thrust(0.0, predicted_cos_tilt(q, BodyRates(0.0, -rate, 0.0), lag))
    assert thrust >= specific_thrust(0.0, math.cos(tilt)) - 1e-9
    assert thrust <= 2.0 * GRAVITY


def lift_lost_while_tilting(known_lag):
    """Largest error of the vertical acceleration, m/s², while a vehicle swings by 40° at 1.5 Hz."""
    lag, step, worst = 0.05, 1e-3, 0.0
    thrust = None
    for k in range(2000):
        phase = 3.0 * math.pi * k * step
        tilt = Rotation.from_rotvec((0.7 * math.cos(phase), 0.0, 0.0))
        roll_rate = -0.7 * 3.0 * math.pi * math.sin(phase)
        asked = specific_thrust(
            0.0, predicted_cos_tilt(turned(tilt), BodyRates(roll_rate, 0.0, 0.0), known_lag)
        )
        thrust = asked if thrust is None else thrust + step / lag * (asked - thrust)
        if k > 300:
            worst = max(worst, abs(thrust * cosine(tilt) - GRAVITY))
    return worst


def test_the_lag_of_the_rotors_is_led_while_the_vehicle_tilts():
    assert lift_lost_while_tilting(0.0) > 0.9
    assert lift_lost_while_tilting(0.05) < 0.4


@given(accelerations, accelerations, accelerations)
def test_what_thrust_cannot_give_is_taken_from_the_horizontal_part(north, east, down):
    found = acceleration_within_thrust((north, east, down), SMALLEST, LARGEST)
    lift, length = GRAVITY - found[2], math.hypot(*found[:2])
    assert SMALLEST - 1e-6 <= math.hypot(lift, length) <= LARGEST + 1e-6
    assert found[0] * east == pytest.approx(found[1] * north, abs=1e-6)
    assert found[0] * north + found[1] * east >= 0.0
    wanted = GRAVITY - down
    if SMALLEST < wanted < LARGEST:
        assert found[2] == pytest.approx(down)
    if math.hypot(north, east) > length + 1e-6:
        # The last of the thrust is not spent on tilt.
        assert math.hypot(lift, length) == pytest.approx(max(TILT_THRUST_SHARE * LARGEST, lift))


def test_the_height_comes_first():
    assert acceleration_within_thrust((3.0, -1.0, 0.5), SMALLEST, LARGEST) == pytest.approx(
        (3.0, -1.0, 0.5)
    )
    north, east, down = acceleration_within_thrust((20.0, 0.0, -5.0), SMALLEST, LARGEST)
    assert down == pytest.approx(-5.0)
    assert north == pytest.approx(
        math.sqrt((TILT_THRUST_SHARE * LARGEST) ** 2 - (GRAVITY + 5.0) ** 2)
    )
    assert east == 0.0
    # More lift than there is: all of it goes upwards.
    assert acceleration_within_thrust((5.0, 5.0, -30.0), SMALLEST, LARGEST) == pytest.approx(
        (0.0, 0.0, GRAVITY - LARGEST)
    )
    # Faster down than the least thrust lets it fall.
    assert acceleration_within_thrust((0.0, 1.0, 20.0), SMALLEST, LARGEST) == pytest.approx(
        (0.0, 1.0, GRAVITY - math.sqrt(3.0))
    )
