"""The way to a planner and into it: names, options, limits, and what a call takes and refuses."""

import math
from functools import partial

import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.attitude import (
    LAW_NAMES,
    BodyRates,
    Coefficients,
    InvalidPeriodError,
    InvalidQuaternionError,
    InvalidTargetError,
    Limits,
    Target,
    attitude,
    make_planner,
)
from companion.attitude.first_order import first_order
from companion.attitude.limits import make_constants
from companion.attitude.representation import limited_target

LEVEL = (1.0, 0.0, 0.0, 0.0)
Q = attitude(Coefficients(0.3, -0.2), 1.0)
every_planner = pytest.mark.parametrize("name", LAW_NAMES)


def test_the_names_are_those_of_the_contract():
    assert set(LAW_NAMES) >= {"first-order", "exact", "quaternion", "so3", "euler"}


def test_unknown_planner_names_the_known_ones():
    with pytest.raises(ValueError, match="first-order"):
        make_planner("first_order")


@every_planner
@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"gain": 0.0}, "gain"),
        ({"gain": 1e-300}, "gain"),
        ({"gain": math.nan}, "gain"),
        ({"gain": math.inf}, "gain"),
        ({"yaw_gain": -1.0}, "yaw_gain"),
        ({"yaw_gain": math.inf}, "yaw_gain"),
        ({"recovery_angle": 1.5}, "recovery_angle"),
        ({"recovery_angle": 0.0}, "recovery_angle"),
        ({"recovery_angle": math.nan}, "recovery_angle"),
        ({"limits": Limits(math.radians(80))}, "recovery_angle"),
    ],
)
def test_senseless_options_are_refused(name, options, words):
    with pytest.raises(ValueError, match=words):
        make_planner(name, **options)


@pytest.mark.parametrize(
    "values",
    [
        {"max_tilt": 0.0},
        {"max_tilt": math.pi / 2},
        {"max_tilt_rate": -1.0},
        {"max_tilt_rate": math.inf},
        {"max_yaw_rate": math.nan},
        {"shape": "round"},
        {"shape": "paper", "max_tilt_rate": 1.0},
    ],
)
def test_senseless_limits_are_refused(values):
    with pytest.raises(ValueError, match=r"tilt|rate|shape"):
        Limits(**values)


def test_a_limit_that_is_not_set_is_infinite():
    free = make_constants(5.0, 2.0, Limits())
    assert free.max_tilt_rate == free.max_yaw_rate == free.max_speed == math.inf
    assert free.tilt_rate_weight == free.speed_weight == 0.0
    assert free.max_target_norm == pytest.approx(math.sin(math.radians(75)))
    paper = make_constants(5.0, 2.0, Limits(math.radians(60), 1.6, shape="paper"))
    assert paper.max_speed == pytest.approx(0.8)
    assert paper.max_target_norm == pytest.approx(math.sqrt(0.75))
    tight = make_constants(5.0, 2.0, Limits(math.radians(60), 1.6))
    assert tight.max_speed == math.inf


BAD_TARGETS = [
    Target(math.nan, 0.0, 0.0),
    Target(0.0, math.inf, 0.0),
    Target(1e200, 0.0, 0.0),
    Target(0.0, 0.0, math.nan),
    Target(0.0, 0.0, math.inf),
    Target(0.0, 0.0, 0.0, math.nan),
    Target(0.0, 0.0, 0.0, -math.inf),
    Target(0.0, 0.0, math.inf, -math.inf),
]


@every_planner
@pytest.mark.parametrize("target", BAD_TARGETS)
def test_a_target_that_is_not_finite_is_refused_each_time(name, target):
    planner = make_planner(name)
    good = Target(-0.1, 0.2, 0.8)
    before = planner.rates(Q, good, 0.01)
    for _ in range(2):
        with pytest.raises(InvalidTargetError, match="not finite"):
            planner.rates(Q, target, 0.01)
    assert planner.rates(Q, good, 0.01) == before


@every_planner
@pytest.mark.parametrize(
    "q",
    [
        (math.nan, 0.0, 0.0, 0.0),
        (1.0, math.inf, 0.0, 0.0),
        (1.01, 0.0, 0.0, 0.0),
        (0.0, 0.0, 0.0, 0.0),
    ],
)
def test_an_attitude_that_is_not_a_rotation_is_refused(name, q):
    with pytest.raises(InvalidQuaternionError):
        make_planner(name).rates(q, Target(0.0, 0.0, 0.0), 0.01)


@every_planner
def test_norm_off_by_a_little_gives_the_same_rates(name):
    planner = make_planner(name)
    target = Target(-0.1, 0.2, 0.8)
    off = planner.rates(tuple(1.0009 * c for c in Q), target, 0.01)
    assert tuple(off) == pytest.approx(tuple(planner.rates(Q, target, 0.01)), abs=1e-12)


@every_planner
def test_rates_are_body_rates_whatever_else_is_known(name):
    planner = make_planner(name)
    target = Target(-0.1, 0.2, 0.8)
    rates = planner.rates(Q, target, 0.01)
    assert type(rates) is BodyRates
    assert (rates.roll, rates.pitch, rates.yaw) == tuple(rates)
    assert planner.rates(Q, target, 0.01, BodyRates(3.0, 2.0, 1.0)) == rates


@every_planner
def test_targets_reused_and_replaced_are_each_answered_for_themselves(name):
    """The planner keeps the last target's admitted form; here it must never answer for another."""
    planner = make_planner(name, limits=Limits(math.radians(30)))
    one, other = Target(-0.1, 0.2, 0.8), Target(0.9, 0.7, -7.0)  # the second is shortened, wrapped
    fresh = [
        make_planner(name, limits=Limits(math.radians(30))).rates(Q, target, 0.01)
        for target in (one, other)
    ]
    assert fresh[0] != fresh[1]
    for asked in (0, 1, 1, 0, 0, 1, 0):
        assert planner.rates(Q, (one, other)[asked], 0.01) == fresh[asked]
    for step in range(200):  # short-lived targets, whose addresses come again
        values = (0.001 * step, -0.1, 0.02 * step, 0.0)
        expected = make_planner(name, limits=Limits(math.radians(30)))
        kept = Target(*values)
        assert planner.rates(Q, Target(*values), 0.01) == expected.rates(Q, kept, 0.01)


@every_planner
def test_a_target_may_be_any_tuple_of_its_four(name):
    class Named(Target):
        """A user's own kind of target."""

    planner = make_planner(name)
    values = (-0.1, 0.2, 0.8, 0.3)
    expected = planner.rates(Q, Target(*values), 0.01)
    assert planner.rates(Q, Named(*values), 0.01) == expected
    assert planner.rates(Q, values, 0.01) == expected


@every_planner
def test_a_heading_whole_turns_away_is_the_same_heading(name):
    planner = make_planner(name)
    rates = planner.rates(Q, Target(-0.1, 0.2, 0.8), 0.01)
    for turns in (-3, 1, 10):
        turned = planner.rates(Q, Target(-0.1, 0.2, 0.8 + 2 * math.pi * turns), 0.01)
        assert tuple(turned) == pytest.approx(tuple(rates), abs=1e-12)


@given(
    st.floats(-1e150, 1e150), st.floats(-1e150, 1e150), st.floats(-1e6, 1e6), st.floats(0.01, 0.99)
)
def test_a_limited_target_keeps_its_direction_and_meaning(north, east, heading, longest):
    target = Target(north, east, heading, 0.3)
    north_then, east_then, heading_then, rate = limited_target(target, longest)
    scale = longest / max(math.hypot(north, east), longest)
    assert (north_then, east_then) == pytest.approx((scale * north, scale * east), abs=1e-12)
    assert -math.pi < heading_then <= math.pi
    assert math.cos(heading_then - heading) == pytest.approx(1.0, abs=1e-9)
    assert rate == 0.3


def test_a_target_within_its_limits_is_returned_as_it_is():
    target = Target(0.3, -0.2, math.pi, 0.1)
    assert limited_target(target, 0.5) is target


def test_level_and_on_target_nothing_is_asked():
    for name in LAW_NAMES:
        rates = make_planner(name).rates(LEVEL, Target(0.0, 0.0, 0.0), 0.01)
        assert tuple(rates) == pytest.approx((0.0, 0.0, 0.0), abs=1e-15)


def test_a_law_uses_other_gains_and_limits_from_the_next_sample_on():
    planner = make_planner("first-order", gain=4.0, limits=Limits(max_tilt=0.6))
    target = Target(0.5, 0.0, 0.0)
    before = planner.rates(LEVEL, target, 0.004)
    narrow = make_planner("first-order", gain=2.0, limits=Limits(max_tilt=0.2))
    planner.retune(narrow.constants)
    found = planner.rates(LEVEL, target, 0.004)
    assert found == narrow.rates(LEVEL, target, 0.004) != before


@pytest.mark.parametrize("axis", ["roll", "pitch", "yaw"])
def test_each_axis_of_model_following_has_its_own_response(axis):
    own = {"lag": 0.03, "dead_time": 0.02, "acceleration": 9.0}
    options = {"lag": 0.05, "dead_time": 0.04, "acceleration": 20.0}
    prefix = "" if axis == "roll" else f"{axis}_"
    planner = make_planner(
        "model-following", 5.0, **options | {f"{prefix}{key}": own[key] for key in own}
    )
    forward = planner._feed_forward
    axes = dict(zip(("roll", "pitch", "yaw"), (*forward.tilt, forward.yaw), strict=True))
    found = {name: (each.lag, each.dead_time, each.acceleration) for name, each in axes.items()}
    theirs = own if axis == "roll" else options  # pitch and yaw follow roll
    expected = {name: tuple((own if name == axis else theirs).values()) for name in axes}
    assert found == expected


def test_the_yaw_rate_of_model_following_stays_within_its_limit():
    planner = make_planner(
        "model-following", 5.0, 4.0, Limits(max_yaw_rate=0.3), lag=0.05, dead_time=0.0
    )
    planner.reset(LEVEL)
    found = [planner.rates(LEVEL, Target(0.0, 0.0, 2.0), 0.01).yaw for _ in range(50)]
    assert max(found) == pytest.approx(0.3)


@pytest.mark.parametrize("dt", [0.0, -0.01, math.nan, math.inf])
@pytest.mark.parametrize(
    ("name", "options"),
    [*((name, {}) for name in LAW_NAMES), ("model-following", {"lag": 0.05, "dead_time": 0.04})],
)
def test_a_period_that_is_not_positive_and_finite_is_refused(name, options, dt):
    planner = make_planner(name, **options)
    with pytest.raises(InvalidPeriodError, match="dt must be positive"):
        planner.rates(LEVEL, Target(0.2, 0.0, 0.0), dt)


@every_planner
def test_none_is_no_target_from_the_first_sample_on(name):
    planner = make_planner(name)
    for _ in range(2):
        with pytest.raises(InvalidTargetError, match="three or four numbers"):
            planner.rates(LEVEL, None, 0.01)


@pytest.mark.parametrize("options", [{}, {"lag": 0.05}, {"dead_time": 0.04}])
def test_model_following_needs_the_times_of_the_rate_loop(options):
    with pytest.raises(ValueError, match="needs lag and dead_time"):
        make_planner("model-following", **options)


@pytest.mark.parametrize("returned", [(1.0, 2.0), None, 3.0, ("a", "b", "c"), (1.0, 2.0, None)])
def test_a_law_that_does_not_return_three_numbers_is_refused_when_it_is_made(returned):
    def mine(q, target, dt, constants):
        return returned

    with pytest.raises(TypeError, match=r"the law 'mine' returned .* three numbers"):
        make_planner(mine)


def test_a_class_without_a_method_of_a_planner_is_refused():
    class Halfway:
        def __init__(self, constants):
            self.constants = constants

        def rates(self, q, target, dt, body_rates=None):
            return 0.0, 0.0, 0.0

    with pytest.raises(TypeError, match=r"Halfway is no planner: it has no method reset\(\)"):
        make_planner(Halfway)


def test_a_law_without_a_name_is_named_as_python_shows_it():
    with pytest.raises(TypeError, match=r"functools.partial\(.*\)' does not take the option 'lag'"):
        make_planner(partial(first_order), lag=0.05)


def test_an_option_of_another_planner_is_named_with_the_planner():
    with pytest.raises(TypeError, match="'exact' does not take the option 'lag'"):
        make_planner("exact", lag=0.05)


@pytest.mark.parametrize("limits", [None, {"max_tilt": 0.5}])
def test_limits_are_limits(limits):
    with pytest.raises(TypeError, match=r"companion\.attitude\.Limits"):
        make_planner("exact", limits=limits)
