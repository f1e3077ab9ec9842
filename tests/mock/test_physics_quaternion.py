"""The mock's quaternions against SciPy's rotations."""

from math import cos, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sitl_mock.physics.quaternion import from_yaw, multiply, normalise, to_body, yaw

component = st.floats(-1.0, 1.0)
unit = (
    st.tuples(component, component, component, component)
    .filter(lambda q: sum(c * c for c in q) > 1e-2)
    .map(normalise)
)
vector = st.tuples(*[st.floats(-50.0, 50.0)] * 3)


def scipy_of(q):
    w, x, y, z = q
    return Rotation.from_quat([x, y, z, w])


@settings(derandomize=True)
@given(unit, unit)
def test_product_is_scipys(left, right):
    expected = (scipy_of(left) * scipy_of(right)).as_matrix()
    np.testing.assert_allclose(scipy_of(multiply(left, right)).as_matrix(), expected, atol=1e-12)


@settings(derandomize=True)
@given(unit, vector)
def test_to_body_is_the_inverse_rotation(q, world):
    expected = scipy_of(q).inv().apply(world)
    np.testing.assert_allclose(to_body(q, world), expected, atol=1e-11)


@settings(derandomize=True)
@given(unit)
def test_yaw_is_the_euler_yaw(q):
    forward = scipy_of(q).as_matrix()[:, 0]
    horizontal = np.hypot(forward[0], forward[1])
    angle = yaw(q)
    np.testing.assert_allclose(
        [horizontal * cos(angle), horizontal * sin(angle)], forward[:2], atol=1e-7
    )


@pytest.mark.parametrize("angle", [-3.0, -0.5, 0.0, 1.2, 3.1])
def test_from_yaw(angle):
    assert yaw(from_yaw(angle)) == pytest.approx(angle)
