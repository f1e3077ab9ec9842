"""Equations 9 and 10 and their inverse, against SciPy's rotations."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from companion.attitude import (
    Coefficients,
    InvalidQuaternionError,
    attitude,
    coefficients,
    decompose,
    heading,
    wrap_angle,
)
from tests.attitude.independent import coefficients_of
from tests.attitude.simulate import quaternion, rotation, upright

angles = st.floats(-math.pi, math.pi)
unit_quaternions = st.tuples(*[st.floats(-1, 1)] * 4).filter(
    lambda v: math.sqrt(sum(c * c for c in v)) > 0.1
)


def unit(v):
    norm = math.sqrt(sum(c * c for c in v))
    return tuple(c / norm for c in v)


@given(unit_quaternions)
def test_split_recomposes_as_tilt_times_yaw(v):
    q = unit(v)
    a, b, x, y, z = decompose(q)
    assert a >= 0.0
    tilt = Rotation.from_quat([x, y, 0.0, a])
    yaw = Rotation.from_quat([0.0, 0.0, z, b])
    assert ((tilt * yaw).inv() * rotation(q)).magnitude() < 1e-7


@given(unit_quaternions)
def test_coefficients_are_the_horizontal_thrust_direction_whatever_the_sign(v):
    q = unit(v)
    assert coefficients(q) == pytest.approx(coefficients_of(rotation(q)), abs=1e-12)
    assert coefficients(tuple(-c for c in q)) == coefficients(q)


def test_coefficients_agree_with_the_rotation_upside_down():
    c = coefficients((0.0, 1.0, 0.0, 0.0))
    assert c == pytest.approx(coefficients_of(rotation((0.0, 1.0, 0.0, 0.0))), abs=1e-12)


@given(unit_quaternions)
def test_heading_does_not_depend_on_the_sign(v):
    q = unit(v)
    assume(math.hypot(q[0], q[3]) > 1e-6)
    there, back = heading(q), heading(tuple(-c for c in q))
    assert -math.pi < there <= math.pi
    assert math.cos(there - back) == pytest.approx(1.0, abs=1e-12)


@given(st.floats(0, 0.999), angles, angles)
def test_attitude_is_the_inverse(sine, bearing, psi):
    c = Coefficients(sine * math.cos(bearing), sine * math.sin(bearing))
    q = attitude(c, psi)
    assert (upright(c, psi).inv() * rotation(q)).magnitude() < 1e-7
    assert coefficients(q) == pytest.approx(c, abs=1e-12)
    assert wrap_angle(heading(q) - psi) == pytest.approx(0.0, abs=1e-9)


def test_level_heading_is_euler_yaw():
    for yaw in np.linspace(-3.0, 3.0, 25):
        assert heading(quaternion(Rotation.from_euler("z", yaw))) == pytest.approx(yaw)


def test_norm_slightly_off_is_normalised():
    q = attitude(Coefficients(0.3, -0.2), 1.0)
    stretched = tuple(1.0009 * c for c in q)
    assert coefficients(stretched) == pytest.approx(coefficients(q), abs=1e-12)


@pytest.mark.parametrize(
    "q",
    [
        (1.002, 0.0, 0.0, 0.0),
        (0.99, 0.0, 0.0, 0.0),
        (0.0, 0.0, 0.0, 0.0),
        (math.nan, 0.0, 0.0, 0.0),
        (1.0, 0.0, math.inf, 0.0),
    ],
)
@pytest.mark.parametrize("function", [decompose, coefficients, heading])
def test_unusable_quaternion_is_refused(function, q):
    with pytest.raises(InvalidQuaternionError, match="norm"):
        function(q)


@pytest.mark.parametrize("c", [(0.8, 0.7), (math.nan, 0.0), (math.inf, 0.0)])
def test_no_attitude_for_coefficients_longer_than_one(c):
    with pytest.raises(ValueError, match="norm exceeds 1"):
        attitude(Coefficients(*c), 0.0)


@given(st.floats(-1e4, 1e4))
def test_wrap_angle(angle):
    wrapped = wrap_angle(angle)
    assert -math.pi < wrapped <= math.pi
    assert math.cos(wrapped - angle) == pytest.approx(1.0, abs=1e-9)


def test_coefficients_of_length_one_lie_on_the_horizon():
    assert coefficients(attitude(Coefficients(0.0, -1.0), 0.4)) == pytest.approx((0.0, -1.0))


@pytest.mark.parametrize("angle", [math.nan, math.inf])
def test_an_attitude_has_a_finite_heading(angle):
    with pytest.raises(ValueError, match="a heading must be finite"):
        attitude(Coefficients(0.2, 0.0), angle)
