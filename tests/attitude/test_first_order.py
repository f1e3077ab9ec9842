"""What makes the law of the paper: the kinematics inverted, a heading that leaves tilt alone."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.attitude import Coefficients, Target, heading, make_planner, wrap_angle
from tests.attitude.independent import coefficients_of, held
from tests.attitude.simulate import fly, quaternion, upright


@given(
    st.floats(0, 0.9),
    st.floats(-3.1, 3.1),
    st.floats(-3.1, 3.1),
    st.floats(-0.6, 0.6),
    st.floats(-0.6, 0.6),
)
def test_rates_are_the_exact_inverse_of_the_kinematics(sine, bearing, psi, north, east):
    """Finite difference of the coefficients along the commanded rate is p·(c_d − c)."""
    c = Coefficients(sine * math.cos(bearing), sine * math.sin(bearing))
    r = upright(c, psi)
    w = make_planner("first-order", 4.0, yaw_gain=0.0).rates(
        quaternion(r), Target(north, east, psi), 1e-3
    )
    h = 1e-5
    ahead, behind = held(r, w, h), held(r, w, -h)
    slope = (coefficients_of(ahead) - coefficients_of(behind)) / (2 * h)
    assert slope == pytest.approx(4.0 * (np.array([north, east]) - np.array(c)), abs=1e-5)
    turned = wrap_angle(heading(quaternion(ahead)) - heading(quaternion(behind))) / (2 * h)
    assert turned == pytest.approx(0.0, abs=1e-5)


@pytest.mark.parametrize("name", ["first-order", "exact"])
def test_yaw_goes_the_short_way_and_leaves_the_tilt_alone(name):
    planner = make_planner(name, 5.0, yaw_gain=2.0)
    c = Coefficients(0.3, -0.2)
    path, rates, end = fly(planner, upright(c, 3.0), Target(*c, -3.0), 5.0, 0.002)
    assert rates[0][2] > 0.0
    assert wrap_angle(heading(quaternion(end)) + 3.0) == pytest.approx(0.0, abs=1e-3)
    assert np.abs(path - np.array(c)).max() < 1e-9
