"""The tilt-yaw split and the rates that move it, against SciPy and by central differences."""

import math
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from companion.attitude.kinematics import (
    cos_tilt,
    half_tilt_products,
    heading_of,
    law_weight,
    levelling_rates,
    rates_to_speed,
    rotate_to_heading,
    speed_to_rates,
    split,
    tilt_angle,
)
from companion.attitude.rotation import clamp, first_nonzero_is_negative, limit_rates
from tests.attitude.independent import coefficients_of, headings_of, held, wrapped

DT = 1e-5
ANY = Rotation.random(60, rng=11)
UPRIGHT = Rotation.from_euler(
    "ZYX", np.random.default_rng(12).uniform([-3, -1, -1], [3, 1, 1], (60, 3))
)
RATES = np.random.default_rng(13).uniform(-2.0, 2.0, (60, 3))


def scalars(r):
    """(w, x, y, z) of each."""
    return np.roll(r.as_quat(), 1, axis=1).tolist()


def tilts(r):
    return np.arccos(r.as_matrix()[:, 2, 2])


def motion(r, rates):
    """Speed of the coefficients and of the heading while body rates are held."""
    before, after = held(r, rates, -DT), held(r, rates, DT)
    speed = (coefficients_of(after) - coefficients_of(before)) / (2.0 * DT)
    return speed, wrapped(headings_of(after) - headings_of(before)) / (2.0 * DT)


def test_the_split_is_a_tilt_about_a_level_axis_and_then_a_heading():
    for q, r in zip(scalars(ANY), ANY, strict=True):
        a, b, x, y, z = split(*q)
        whole = Rotation.from_quat([x, y, 0.0, a]) * Rotation.from_quat([0.0, 0.0, z, b])
        assert (whole.inv() * r).magnitude() < 1e-14
        assert half_tilt_products(*q) == pytest.approx((a * a, a * x, a * y), abs=1e-15)


def test_exactly_inverted_the_heading_is_zero():
    assert split(0.0, 0.6, -0.8, 0.0) == (0.0, 1.0, 0.6, -0.8, 0.0)


def test_the_tilt_is_the_angle_of_the_thrust_axis_and_bears_a_norm_that_is_off():
    found = [(tilt_angle(q[1], q[2]), cos_tilt(q[1], q[2])) for q in scalars(ANY)]
    expected = np.column_stack([tilts(ANY), np.cos(tilts(ANY))])
    assert np.abs(np.array(found) - expected).max() < 1e-12
    assert tilt_angle(0.0, 0.0) == 0.0
    assert tilt_angle(0.7, 0.72) == math.pi


def test_the_heading_is_the_twist_whichever_sign_the_quaternion_has():
    for q, heading in zip(scalars(ANY), headings_of(ANY), strict=True):
        for w, z in ((q[0], q[3]), (-q[0], -q[3])):
            assert wrapped(heading_of(math.hypot(w, z), w, z) - heading) == pytest.approx(0.0)
    assert heading_of(0.5, 0.0, 0.5) == pytest.approx(math.pi)


def test_rates_move_the_coefficients_and_the_heading_as_differences_say():
    speed, turn = motion(UPRIGHT, RATES)
    found = [
        rates_to_speed(*q, *rates)
        for q, rates in zip(scalars(UPRIGHT), RATES.tolist(), strict=True)
    ]
    assert np.abs(np.array(found) - np.column_stack([speed, turn])).max() < 1e-8


def test_the_rates_for_a_speed_make_it_and_keep_the_heading():
    rates, wanted = [], []
    for q, (e_x, e_y, _) in zip(scalars(UPRIGHT), RATES.tolist(), strict=True):
        square, ax, ay = half_tilt_products(*q)
        cosine = 2.0 * square - 1.0
        roll, pitch, yaw = speed_to_rates(q[0], q[3], ax, ay, 1.0 / square, 1.0 / cosine, e_x, e_y)
        rates.append((roll, pitch, yaw))
        wanted.append((-e_y, e_x))  # north is −2ay, east is 2ax
    speed, turn = motion(UPRIGHT, np.array(rates))
    assert np.abs(speed - wanted).max() < 1e-8
    # The third value is what the yaw rate has to be.
    assert np.abs(turn).max() < 1e-8


def test_horizontal_rates_are_seen_from_the_heading():
    for heading, r_x, r_y in RATES.tolist():
        seen = Rotation.from_euler("Z", heading).inv().apply([r_x, r_y, 0.0])
        found = rotate_to_heading(math.cos(heading), math.sin(heading), r_x, r_y)
        assert found == pytest.approx(seen[:2], abs=1e-14)


def test_the_share_of_the_law_fades_smoothly():
    share = [law_weight(0.5 - step / 16.0, 0.5, 4.0) for step in range(6)]
    assert share == [1.0, 0.84375, 0.5, 0.15625, 0.0, 0.0]


def test_levelling_turns_about_the_axis_of_the_tilt():
    gain = 1.5
    rates = []
    for q in scalars(ANY):
        a = math.hypot(q[0], q[3])
        rates.append((*levelling_rates(gain, a, 1.0 / a**2, *q), 0.0))
        opposite = levelling_rates(gain, a, 1.0 / a**2, *(-value for value in q))
        assert opposite == pytest.approx(rates[-1][:2])
    after = tilts(held(ANY, rates, DT)) - tilts(held(ANY, rates, -DT))
    falling = 2.0 * gain * np.sin(0.5 * tilts(ANY))
    assert after / (2.0 * DT) == pytest.approx(-falling, abs=1e-6)
    assert np.linalg.norm(rates, axis=1) == pytest.approx(falling)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_inverted_it_levels_as_fast_about_any_axis_and_the_same_for_both_signs(sign):
    found = levelling_rates(1.5, 1e-12, 1e24, 0.0, sign * 0.6, sign * -0.8, 0.0)
    assert found == pytest.approx((-1.8, 2.4))


def test_one_of_two_opposite_vectors_counts_as_negative():
    for v in product((-1.0, 0.0, 1.0), repeat=3):
        first = next((value for value in v if value != 0.0), 0.0)
        assert first_nonzero_is_negative(*v) is (first < 0.0)


@given(st.floats(-9.0, 9.0), st.floats(0.0, 5.0))
def test_clamped_is_numpys_clip(value, bound):
    assert clamp(value, bound) == np.clip(value, -bound, bound)


@given(*[st.floats(-9.0, 9.0)] * 3, *[st.floats(0.1, 9.0)] * 2)
def test_limited_rates_keep_their_direction(roll, pitch, yaw, most, most_yaw):
    found = limit_rates(roll, pitch, yaw, most, most_yaw)
    size = math.hypot(roll, pitch)
    share = most / size if size > most else 1.0
    assert found == pytest.approx((share * roll, share * pitch, np.clip(yaw, -most_yaw, most_yaw)))
