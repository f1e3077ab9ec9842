"""Appendix A: K, the square of body rate per coefficient rate, from finite differences of SciPy."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from companion.attitude import Limits, Target, make_planner
from tests.attitude.independent import attitudes, coefficients_of, held
from tests.attitude.simulate import answers

K_MAX = [(30.0, 1.333), (45.0, 2.0), (60.0, 4.0)]
BEARINGS = np.arange(24) * np.pi / 12
DIRECTIONS = np.arange(360) * np.pi / 180
STEP = 1e-5


def slopes(r, rates):
    """ċ (N, 2) of attitudes under body rates (N, 3), by central differences."""
    return (coefficients_of(held(r, rates, STEP)) - coefficients_of(held(r, rates, -STEP))) / (
        2.0 * STEP
    )


def jacobians(r):
    """∂ċ/∂(ω_x, ω_y), (N, 2, 2)."""
    count = len(r.as_quat())
    columns = [slopes(r, np.tile(axis, (count, 1))) for axis in np.eye(3)[:2]]
    return np.stack(columns, axis=2)


def at_tilt(tilt_deg, headings=0.7):
    sine = np.sin(np.radians(tilt_deg))
    c = sine * np.column_stack([np.cos(BEARINGS), np.sin(BEARINGS)])
    return attitudes(c, np.full(len(BEARINGS), headings))


@pytest.mark.parametrize(("tilt_deg", "printed"), K_MAX)
def test_k_max_is_what_appendix_a_says(tilt_deg, printed):
    """K_max = 1/(1 − 2A_M²)², A_M = sin(tilt/2): the weakest direction of the kinematics."""
    weakest = np.linalg.svd(jacobians(at_tilt(tilt_deg)), compute_uv=False)[:, -1]
    a_m = np.sin(np.radians(tilt_deg) / 2.0)
    assert weakest**-2.0 == pytest.approx((1.0 - 2.0 * a_m**2) ** -2.0, rel=1e-8)
    assert weakest**-2.0 == pytest.approx(printed, rel=1e-3)


@pytest.mark.parametrize(("tilt_deg", "printed"), K_MAX)
def test_the_planner_reaches_k_max_in_the_worst_direction(tilt_deg, printed):
    """All bearings of the tilt, targets a little off in all directions."""
    start = at_tilt(tilt_deg)
    gain, off = 5.0, 1e-2
    planner = make_planner("first-order", gain, yaw_gain=0.0)
    largest = []
    for bearing, q in zip(BEARINGS, start, strict=True):
        c = coefficients_of(q)
        errors = off * np.column_stack([np.cos(DIRECTIONS + bearing), np.sin(DIRECTIONS + bearing)])
        stack = Rotation.from_quat(np.tile(q.as_quat(), (len(DIRECTIONS), 1)))
        rates = answers(planner, stack, [Target(*(c + e), 0.7) for e in errors], 0.01)
        k = (rates[:, 0] ** 2 + rates[:, 1] ** 2) / (gain * off) ** 2
        assert slopes(stack, rates) == pytest.approx(gain * errors, abs=1e-8)
        # Along the tilt it is the worst (DIRECTIONS[0]), across it the best, where K is 1.
        assert np.argmax(k) in (0, 180)
        assert k.min() == pytest.approx(1.0, rel=1e-9)
        largest.append(k.max())
    assert largest == pytest.approx(np.full(24, np.cos(np.radians(tilt_deg)) ** -2.0), rel=1e-9)
    assert largest == pytest.approx(np.full(24, printed), rel=1e-3)


def test_the_limit_of_equation_33_reaches_w_m_only_there():
    """At full tilt and along it, W_M·cos(max_tilt) of coefficient rate is W_M of body rate."""
    tilt = np.radians(45.0)
    limits = Limits(tilt, 1.5, shape="paper")
    planner = make_planner("first-order", 5.0, limits=limits)
    start = attitudes([np.sin(tilt), 0.0], [0.0])
    along = answers(planner, start, [Target(-0.6, 0.0, 0.0)], 0.01)
    assert np.hypot(*along[0, :2]) == pytest.approx(1.5, rel=1e-12)
    level = answers(planner, attitudes([0.0, 0.0], [0.0]), [Target(-0.6, 0.0, 0.0)], 0.01)
    assert np.hypot(*level[0, :2]) == pytest.approx(1.5 * np.cos(tilt), rel=1e-12)
