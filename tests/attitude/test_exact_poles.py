"""Every planner at the attitudes where formulas divide by zero: 90°, 180°, and next to them."""

import contextlib
import itertools
import math

import pytest
from hypothesis import given
from hypothesis import settings as effort
from hypothesis import strategies as st

from companion.attitude import (
    PLANNER_NAMES,
    InvalidBodyRatesError,
    InvalidQuaternionError,
    InvalidTargetError,
    Limits,
    Target,
    make_planner,
)
from companion.attitude.kinematics import tilt_angle
from companion.attitude.planner import LawPlanner

ROOT = 1.0 / math.sqrt(2.0)
COMPONENTS = (0.0, -0.0, ROOT, -ROOT, 1.0, -1.0, 0.5, -0.5)
TINY = (5e-324, -1e-308, 1e-160, -1e-17, 1e-12)
WITHIN_TOLERANCE = (1.0, 1.0 + 9.9e-4, 1.0 - 9.9e-4)
BOUNDS = Limits(0.6, 3.0, 1.0)
TARGET = Target(0.3, -0.2, 2.0, 0.1)
BODY_RATES = [None, (0.0, 0.0, 0.0), (1.0, -2.0, 3.0), (99.0, -99.0, 99.0), (math.nan, 0.0, 0.0)]
RESPONSES = {
    "immediate": {"lag": 0.0, "dead_time": 0.0},
    "lag": {"lag": 0.05, "dead_time": 0.03, "yaw_lag": 0.15, "yaw_dead_time": 0.1},
    "unlike": {
        "lag": 0.05,
        "dead_time": 0.0,
        "damping": 0.7,
        "pitch_lag": 0.09,
        "pitch_dead_time": 0.03,
    },
    "slew": {
        "lag": 0.05,
        "dead_time": 0.0,
        "acceleration": 20.0,
        "yaw_acceleration": 5.0,
        "frame_lead": 0.02,
    },
}
PLANNERS = [(name, {}) for name in PLANNER_NAMES if name != "model-following"] + [
    ("model-following", response) for response in RESPONSES.values()
]


def is_about_unit(q):
    return abs(math.hypot(*q) - 1.0) < 1e-9


POLES = [q for q in itertools.product(COMPONENTS, repeat=4) if is_about_unit(q)]
NEXT_TO_POLES = [
    q
    for tiny in TINY
    for q in itertools.product((0.0, ROOT, 1.0, tiny), repeat=4)
    if tiny in q and is_about_unit(q)
]
any_attitude = st.one_of(
    st.tuples(*[st.floats(-1.0, 1.0)] * 4)
    .filter(lambda q: math.hypot(*q) > 0.1)
    .map(lambda q: tuple(c / math.hypot(*q) for c in q)),
    st.sampled_from(POLES + NEXT_TO_POLES),
)
any_body_rates = st.one_of(st.none(), st.tuples(*[st.floats(width=32)] * 3))
any_number = st.one_of(st.floats(), st.sampled_from([10**400, None, "one"]))


def assert_usable(rates, bounds):
    assert all(math.isfinite(rate) for rate in rates)
    assert math.hypot(rates.roll, rates.pitch) <= bounds.tilt_rate * (1.0 + 1e-12)
    assert abs(rates.yaw) <= bounds.yaw_rate


@pytest.mark.parametrize(("name", "options"), PLANNERS)
@pytest.mark.parametrize("bounds", [BOUNDS, Limits()])
def test_every_pole_is_answered_at_a_reset_and_after_it(name, options, bounds):
    planner = make_planner(name, limits=bounds, **options)
    # A law neither remembers anything nor looks at the body rates.
    is_law = isinstance(planner, LawPlanner)
    given, times = (BODY_RATES[-1:], 1) if is_law else (BODY_RATES, 2)
    for pole, scale in itertools.product(POLES + NEXT_TO_POLES, WITHIN_TOLERANCE):
        q = tuple(scale * component for component in pole)
        for body_rates in given:
            planner.reset(q, body_rates)
            for _ in range(times):
                assert_usable(planner.rates(q, TARGET, 0.004, body_rates), bounds)


@pytest.mark.parametrize(("name", "options"), PLANNERS)
@effort(max_examples=150)
@given(
    st.lists(st.tuples(any_attitude, any_body_rates, st.booleans()), min_size=1, max_size=6),
    st.tuples(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6), st.floats(-1e9, 1e9)),
    st.floats(-1e9, 1e9),
    st.floats(min_value=0.0, exclude_min=True, allow_infinity=False),
)
def test_any_sequence_of_attitudes_is_answered(name, options, samples, aim, heading_rate, dt):
    planner = make_planner(name, limits=BOUNDS, **options)
    for q, body_rates, anew in samples:
        if anew:
            planner.reset(q, body_rates)
        assert_usable(planner.rates(q, Target(*aim, heading_rate), dt, body_rates), BOUNDS)


@pytest.mark.parametrize(("name", "options"), PLANNERS)
@effort(max_examples=100)
@given(st.lists(any_number, max_size=5), st.lists(any_number, max_size=5))
def test_what_is_no_attitude_or_no_target_is_refused_as_such(name, options, q, target):
    planner = make_planner(name, limits=BOUNDS, **options)
    for arguments in ((tuple(q), TARGET), ((1.0, 0.0, 0.0, 0.0), tuple(target))):
        with contextlib.suppress(InvalidQuaternionError, InvalidTargetError):
            assert_usable(planner.rates(*arguments, 0.004), BOUNDS)


@pytest.mark.parametrize("body_rates", [(1.0, 2.0), (1.0, 2.0, 3.0, 4.0), "abc", 3.0])
@pytest.mark.parametrize("q", [(1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0)])
def test_body_rates_are_three_numbers(q, body_rates):
    planner = make_planner("model-following", lag=0.0, dead_time=0.0)
    with pytest.raises(InvalidBodyRatesError, match="three numbers"):
        planner.reset(q, body_rates)
    with pytest.raises(InvalidBodyRatesError, match="three numbers"):
        planner.rates(q, TARGET, 0.004, body_rates)


def test_a_plan_that_was_reset_upside_down_begins_where_the_tilt_is_small_again():
    upright = (1.0, 0.0, 0.0, 0.0)
    reset_there, begun_here = (
        make_planner("model-following", lag=0.05, dead_time=0.0) for _ in range(2)
    )
    reset_there.reset((0.0, 1.0, 0.0, 0.0))
    begun_here.reset(upright)
    assert reset_there.rates(upright, TARGET, 0.01) == begun_here.rates(upright, TARGET, 0.01)


def test_the_tilt_of_an_inverted_attitude_within_tolerance_is_a_half_turn():
    assert tilt_angle(1.0 + 9.9e-4, 0.0) == math.pi
