"""The polynomials that stand for elementary functions in compiled loops."""

import math
from types import FunctionType

import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.attitude import LAW_NAMES, make_planner, rotation
from companion.attitude.kinematics import heading_of
from companion.batch import series

SMALLEST = 5e-324


@given(st.floats(-1.0, 1.0))
def test_arctangent(t):
    assert series.arctangent(t) == pytest.approx(math.atan(t), rel=1e-14, abs=SMALLEST)


@given(st.floats(0.0, series.LARGEST_SQUARE))
def test_cos_and_sinc(square):
    assert series.cos_and_sinc(square) == pytest.approx(rotation.cos_and_sinc(square), abs=1e-14)


def test_ends_of_the_domains():
    assert series.arctangent(1.0) == pytest.approx(math.pi / 4, abs=1e-14)
    assert series.arctangent(-1.0) == pytest.approx(-math.pi / 4, abs=1e-14)
    assert series.cos_and_sinc(0.0) == pytest.approx((1.0, 1.0), abs=1e-14)
    assert series.cos_and_sinc(0.25) == pytest.approx((math.cos(0.5), 2 * math.sin(0.5)), abs=1e-14)


@pytest.mark.parametrize("square", [0.2501, 10.0, 1e300, math.inf, math.nan])
def test_beyond_its_domain_cos_and_sinc_answers_nan(square):
    assert all(math.isnan(value) for value in series.cos_and_sinc(square))


def called_by(function, seen):
    """All functions that `function` calls, and those that they call."""
    if function in seen:
        return seen
    seen.add(function)
    for name in function.__code__.co_names:
        if isinstance(function.__globals__.get(name), FunctionType):
            called_by(function.__globals__[name], seen)
    return seen


@pytest.mark.parametrize("name", LAW_NAMES)
def test_arctangents_of_one_argument_are_taken_of_half_angles_only(name):
    """The series is good from −1 to 1; `heading_of` makes sure of that, and others may not."""
    functions = called_by(make_planner(name).law, set())
    users = {f for f in functions if f.__globals__.get("atan") and "atan" in f.__code__.co_names}
    assert users <= {heading_of}
