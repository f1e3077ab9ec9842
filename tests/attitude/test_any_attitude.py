"""What every planner owes at every attitude there is: finite rates, within the limits, and home."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import settings as effort
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from companion.attitude import LAW_NAMES, Limits, Target, make_planner
from companion.attitude.representation import normalised
from tests.attitude.independent import attitudes, coefficients_of, headings_of, held, wrapped
from tests.attitude.simulate import answers, fly_all, rotation

components = st.floats(-1, 1)
quaternions = (
    st.tuples(components, components, components, components)
    .filter(lambda v: math.hypot(*v) > 0.1)
    .map(lambda v: tuple(c / math.hypot(*v) for c in v))
)
# Where formulas break: level, inverted, half turns, and next to them.
awkward = st.sampled_from(
    [
        (1.0, 0.0, 0.0, 0.0),
        (0.0, 1.0, 0.0, 0.0),
        (0.0, 0.0, 1.0, 0.0),
        (0.0, 0.0, 0.0, 1.0),
        (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0),
        (math.sqrt(0.5), 0.0, 0.0, -math.sqrt(0.5)),
        (1e-13, 1.0, 0.0, 0.0),
        (1e-7, 0.6, 0.8, 1e-8),
        (1.0, 1e-160, -1e-200, 0.0),
    ]
).map(normalised)
reach = st.one_of(st.floats(-1.5, 1.5), st.sampled_from([0.0, -1e6, 1e-300, 1.0]))
targets = st.builds(Target, reach, reach, st.floats(-10.0, 10.0), st.floats(-3.0, 3.0))
rate_limits = st.one_of(st.none(), st.floats(0.01, 20.0))
limits = st.one_of(
    st.builds(Limits, st.one_of(st.none(), st.floats(0.05, 1.3)), rate_limits, rate_limits),
    st.builds(Limits, st.floats(0.05, 1.3), rate_limits, rate_limits, st.just("paper")),
)
periods = st.floats(math.log(1e-6), math.log(0.5)).map(math.exp)
gains = st.floats(0.1, 20.0)

fuzz = effort(max_examples=150)


@pytest.mark.parametrize("name", LAW_NAMES)
@fuzz
@given(st.one_of(quaternions, awkward), targets, limits, periods, gains, gains)
def test_rates_are_finite_and_within_the_limits(name, q, target, bounds, dt, gain, yaw_gain):
    rates = make_planner(name, gain, yaw_gain, bounds).rates(q, target, dt)
    assert all(math.isfinite(rate) for rate in rates)
    assert math.hypot(rates.roll, rates.pitch) <= bounds.tilt_rate * (1.0 + 1e-12)
    assert abs(rates.yaw) <= bounds.yaw_rate


def between_two_ways(name, q, target):
    """Next to a half turn, where rounding decides, and upside down, where no heading is."""
    if math.hypot(q[0], q[3]) < 1e-6:
        return True
    if name in ("first-order", "exact"):
        return False
    asked = np.array(target[:2])
    longest = math.sin(math.radians(75.0))
    asked *= min(1.0, longest / max(math.hypot(*asked), longest))
    goal = attitudes(asked, [target.heading])
    return (rotation(q).inv() * goal).magnitude()[0] > math.pi - 1e-6


@pytest.mark.parametrize("name", LAW_NAMES)
@fuzz
@given(q=quaternions, target=targets, dt=periods)
def test_opposite_quaternions_give_the_same_rates(name, q, target, dt):
    assume(not between_two_ways(name, q, target))
    planner = make_planner(name, limits=Limits(None, 3.0, 2.0))
    there = planner.rates(q, target, dt)
    back = planner.rates(tuple(-c for c in q), target, dt)
    assert back == pytest.approx(there, abs=1e-6)


SOUTH, INVERTED = (0.0, 0.0, 0.0, 1.0), (0.0, 1.0, 0.0, 0.0)


@pytest.mark.parametrize("q", [SOUTH, INVERTED])
@pytest.mark.parametrize("name", LAW_NAMES)
def test_opposite_quaternions_take_the_same_way_of_an_exact_half_turn(name, q):
    """Both ways are equally short, but the sign of the telemetry should not choose one."""
    planner = make_planner(name)
    there = planner.rates(q, Target(0.0, 0.0, 0.0), 0.01)
    back = planner.rates(tuple(-c for c in q), Target(0.0, 0.0, 0.0), 0.01)
    assert tuple(back) == pytest.approx(tuple(there), abs=1e-9)


@pytest.fixture(scope="module")
def whole_sphere():
    """From level to exactly inverted, leaning to four sides, at two headings."""
    tilts = np.radians([0.0, 30.0, 60.0, 74.9, 75.1, 80.0, 85.1, 90.0, 120.0, 150.0, 179.0, 180.0])
    bearings = np.arange(4) * np.pi / 2 + 0.1
    headings = np.array([-3.0, 0.4])
    tilt, bearing, heading = (g.ravel() for g in np.meshgrid(tilts, bearings, headings))
    level = np.zeros(len(tilt))
    lean = np.column_stack([tilt * np.cos(bearing), tilt * np.sin(bearing), level])
    turn = np.column_stack([level, level, heading])
    return Rotation.from_rotvec(lean) * Rotation.from_rotvec(turn)


@pytest.mark.parametrize("dt", [0.02, 0.04])
@pytest.mark.parametrize("name", LAW_NAMES)
def test_converges_from_the_whole_sphere_within_the_limits(name, dt, whole_sphere):
    bounds = Limits(math.radians(35), np.pi / 2, 1.2)
    planner = make_planner(name, 5.0, limits=bounds)
    target = [Target(0.3, -0.2, 0.5)] * len(whole_sphere.as_quat())
    r = whole_sphere
    for step in range(round(8.0 / dt)):
        # Telemetry may flip the sign of its quaternion at any time.
        seen = Rotation.from_quat(-r.as_quat()) if step % 2 else r
        rates = answers(planner, seen, target, dt)
        assert np.isfinite(rates).all()
        assert np.hypot(rates[:, 0], rates[:, 1]).max() <= np.pi / 2 * (1 + 1e-12)
        assert np.abs(rates[:, 2]).max() <= 1.2
        r = held(r, rates, dt)
    assert np.abs(coefficients_of(r) - [0.3, -0.2]).max() < 2e-3
    assert np.abs(wrapped(headings_of(r) - 0.5)).max() < 2e-3


@pytest.mark.parametrize("name", ["first-order", "exact"])
def test_recovery_always_reduces_the_tilt_and_never_jumps(name):
    """Along sweeps of tilt the rates are continuous; beyond 85° they follow the short arc."""
    w_m = np.pi / 2
    planner = make_planner(name, 5.0, limits=Limits(math.radians(35), w_m))
    tilt = np.radians(np.arange(60.0, 179.0, 0.1))
    for bearing in np.arange(4) * np.pi / 2 + 0.1:
        lean = np.outer(tilt, [np.cos(bearing), np.sin(bearing), 0.0])
        r = Rotation.from_rotvec(lean) * Rotation.from_rotvec([0.0, 0.0, 0.7])
        rates = answers(planner, r, [Target(0.2, 0.3, 0.7)] * len(tilt), 0.01)
        then = np.arccos(held(r, rates, 1e-4).as_matrix()[:, 2, 2])
        assert (then < tilt)[tilt > np.radians(75.0)].all()
        far = tilt > np.radians(85.0)
        assert (then - tilt)[far] == pytest.approx(-w_m * 1e-4, rel=1e-6)
        assert np.abs(np.diff(rates, axis=0)).max() < 0.1


@pytest.mark.parametrize("name", ["first-order", "exact"])
def test_rates_stay_bounded_without_a_rate_limit(name):
    tilt = np.radians(np.arange(0.0, 181.0, 1.0))
    r = Rotation.from_rotvec(np.outer(tilt, [1.0, 0.0, 0.0]))
    rates = answers(make_planner(name, 5.0), r, [Target(0.9, -0.4, 0.0)] * len(tilt), 0.01)
    assert np.hypot(rates[:, 0], rates[:, 1]).max() < 2 * 5.0 / math.cos(math.radians(75))


@pytest.mark.parametrize("name", LAW_NAMES)
@pytest.mark.parametrize("length", [0.7, 1.0, 1e6])
def test_too_long_a_target_is_shortened_along_its_direction(name, length):
    planner = make_planner(name, 5.0, limits=Limits(math.radians(30)))
    target = Target(-0.6 * length, 0.8 * length, 0.0)
    path, _ = fly_all(planner, attitudes([0.0, 0.0], [0.0]), [target], 4.0, 0.01)
    assert path[-1, 0] == pytest.approx([-0.3, 0.4], abs=1e-6)
