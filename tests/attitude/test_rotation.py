"""The rotations on plain floats, as the laws and the batches use them, against SciPy's."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from companion.attitude.rotation import (
    after_constant_rates,
    angle_per_sine,
    attitude_of,
    body_error,
    cos_and_sinc,
    down_in_body,
    euler_angles,
    turned_about_vertical,
    wrap_difference,
)
from tests.attitude.independent import attitudes, held, wrapped

ROTATIONS = Rotation.random(300, rng=7)
OTHERS = Rotation.random(300, rng=8)


def scalars(r):
    """(w, x, y, z) of each."""
    return np.roll(r.as_quat(), 1, axis=1).tolist()


def angles_between(quaternions, r):
    found = Rotation.from_quat(np.roll(quaternions, -1, axis=1))
    return (found.inv() * r).magnitude()


@pytest.mark.parametrize("angle", [0.0, 1e-14, 1e-9, 1e-3, 1.0, 3.0, 7.0])
def test_turned_is_the_rate_held(angle):
    rates = np.random.default_rng(9).normal(size=(300, 3))
    rates *= angle / np.linalg.norm(rates, axis=1, keepdims=True) / 0.02
    found = [
        after_constant_rates(q, w, 0.02)
        for q, w in zip(scalars(ROTATIONS), rates.tolist(), strict=True)
    ]
    assert angles_between(found, held(ROTATIONS, rates, 0.02)).max() < 1e-14
    assert np.linalg.norm(found, axis=1) == pytest.approx(1.0, abs=1e-15)


def test_turned_ten_thousand_times_is_still_a_rotation():
    q = (1.0, 0.0, 0.0, 0.0)
    for _ in range(10_000):
        q = after_constant_rates(q, (0.5, -0.3, 0.2), 0.01)
    assert math.hypot(*q) == pytest.approx(1.0, abs=1e-15)
    whole = Rotation.from_rotvec([50.0, -30.0, 20.0])
    assert angles_between([q], whole).max() < 1e-11


def test_body_error_is_the_short_way_from_one_to_the_other():
    found = [body_error(q, d) for q, d in zip(scalars(ROTATIONS), scalars(OTHERS), strict=True)]
    error = (ROTATIONS.inv() * OTHERS).as_quat(canonical=True)
    assert np.abs(np.roll(found, -1, axis=1) - error).max() < 1e-15


@pytest.mark.parametrize("angle", [0.0, 1e-300, 1e-13, 1e-8, 0.1, 3.1, math.pi])
def test_angle_per_sine_makes_a_rotation_vector(angle):
    x, y, z, w = Rotation.from_rotvec([0.6 * angle, 0.0, 0.8 * angle]).as_quat()
    factor = angle_per_sine(abs(float(w)), math.hypot(x, y, z))
    assert (factor * x, factor * z) == pytest.approx((0.6 * angle, 0.8 * angle), rel=1e-14)


def test_down_in_the_body_is_scipys():
    found = [down_in_body(q) for q in scalars(ROTATIONS)]
    assert np.allclose(found, ROTATIONS.inv().apply((0.0, 0.0, 1.0)), atol=1e-14)


def test_euler_angles_are_scipys():
    found = np.array([euler_angles(q) for q in scalars(ROTATIONS)])
    assert np.abs(wrapped(found - ROTATIONS.as_euler("ZYX")[:, ::-1])).max() < 1e-12


@pytest.mark.parametrize("pitch", [math.pi / 2, -math.pi / 2])
def test_euler_angles_at_their_singularity_are_finite(pitch):
    for yaw in (-2.0, 0.0, 0.3, 3.0):
        q = scalars(Rotation.from_euler("ZYX", [[yaw, pitch, 0.0]]))[0]
        roll, found, heading = euler_angles(q)
        assert found == pytest.approx(pitch, abs=1e-7)
        assert math.isfinite(roll + heading)


def test_attitude_of_is_upright_with_its_coefficients():
    rng = np.random.default_rng(10)
    c = rng.uniform(-0.7, 0.7, (300, 2))
    headings = rng.uniform(-np.pi, np.pi, 300)
    found = [attitude_of(*row) for row in np.column_stack([c, headings]).tolist()]
    assert angles_between(found, attitudes(c, headings)).max() < 1e-14


@pytest.mark.parametrize("angle", [0.0, 1e-200, 1e-8, 1.0, 3.0])
def test_cos_and_sinc(angle):
    cosine, sinc = cos_and_sinc(angle * angle)
    assert cosine == pytest.approx(math.cos(angle), abs=1e-15)
    assert sinc == pytest.approx(np.sinc(angle / math.pi), abs=1e-15)


def test_the_short_way_is_the_same_direction_at_most_half_a_turn_off():
    for angle in np.linspace(-2 * math.pi, 2 * math.pi, 81).tolist():
        brought = wrap_difference(angle)
        assert -math.pi < brought <= math.pi
        assert math.cos(brought - angle) == pytest.approx(1.0, abs=1e-14)


def test_a_turn_returns_a_unit_quaternion_along_one_that_is_slightly_off():
    q = (0.5, -0.5, 0.5, 0.5)
    found = after_constant_rates(tuple(1.0008 * part for part in q), (0.4, -0.3, 0.2), 0.01)
    assert found == pytest.approx(after_constant_rates(q, (0.4, -0.3, 0.2), 0.01), abs=2e-6)


@pytest.mark.parametrize("angle", [0.7, -2.9])
def test_a_turn_about_the_vertical_turns_the_world_axes(angle):
    """Clockwise from above is positive about the world's down axis."""
    expected = scalars(Rotation.from_rotvec([0.0, 0.0, angle]) * ROTATIONS)
    for q, there in zip(scalars(ROTATIONS), expected, strict=True):
        found = turned_about_vertical(q, angle)
        alike = math.copysign(1.0, sum(a * b for a, b in zip(found, there, strict=True)))
        assert [alike * part for part in found] == pytest.approx(there, abs=1e-12)
