"""The slope's mean between two times, against the integral of what was fed in."""

from math import cos, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from companion.guidance.motion_observer import SlopeHistory

DT = 0.004


def fed(seconds=1.0, slope=lambda t: (sin(3.0 * t), cos(2.0 * t))):
    history = SlopeHistory()
    for n in range(round(seconds / DT) + 1):
        history.add(n * DT, slope(n * DT))
    return history


@given(st.floats(0.3, 1.0), st.floats(0.3, 1.0))
def test_the_mean_is_that_of_the_curve(one, other):
    start, end = sorted((one, other))
    if end - start < 0.02:  # no positions come quicker
        return
    north, east = fed().mean(start, end)
    assert north == pytest.approx(
        quad(lambda t: sin(3 * t), start, end)[0] / (end - start), abs=1e-3
    )
    assert east == pytest.approx(
        quad(lambda t: cos(2 * t), start, end)[0] / (end - start), abs=1e-3
    )


def test_beyond_the_newest_the_slope_stays():
    history = fed(slope=lambda t: (t, 0.0))
    north, east = history.mean(1.0, 1.1)
    assert (north, east) == pytest.approx((1.0, 0.0))
    assert history.mean(0.9, 1.1)[0] == pytest.approx((0.095 + 0.1) / 0.2)


def test_over_no_time_it_is_the_newest():
    history = fed(slope=lambda t: (t, -t))
    assert history.mean(1.0, 1.0) == history.newest == pytest.approx((1.0, -1.0))
    assert SlopeHistory().mean(0.0, 1.0) == (0.0, 0.0)


def test_a_clock_that_goes_back_starts_it_anew():
    history = fed(slope=lambda _: (0.5, 0.5))
    history.add(0.2, (0.1, 0.0))
    history.add(0.3, (0.3, 0.0))
    assert history.mean(0.2, 0.3) == pytest.approx((0.2, 0.0))


def test_after_a_heading_jump_one_attitude_counts_for_the_time_before_it():
    history = fed(slope=lambda _: (0.5, 0.5))
    history.forget()
    history.add(1.2, (0.1, -0.2))
    assert history.mean(1.1, 1.3) == pytest.approx((0.1, -0.2))
    assert history.mean(1.0, 1.1) == pytest.approx((0.1, -0.2))


def test_it_keeps_the_newest_only():
    history = fed(seconds=60.0, slope=lambda t: (t, 0.0))
    assert history.mean(59.5, 60.0)[0] == pytest.approx(59.75)
    assert np.isfinite(history.mean(0.0, 1.0)).all()
