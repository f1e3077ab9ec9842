"""The swing of a hover: told from noise, gusts and slow motion, whatever the clock does."""

from math import isnan

import numpy as np
import pytest

from companion.recording.measurements.swing import measure_swing

TIME = 70.0 + np.arange(0.0, 8.0, 0.004)
RANDOM = np.random.default_rng(5)


def turned(angles):
    """The rates of angles (N, 2) in rad."""
    return np.gradient(angles, TIME, axis=0)


def both(roll, pitch):
    return np.column_stack([roll, pitch])


@pytest.mark.parametrize("period", [0.25, 0.45, 1.0, 1.7])
def test_a_swing_under_noise_has_its_size_and_period(period):
    phase = 2.0 * np.pi * TIME / period
    noise = RANDOM.normal(0.0, 0.1, (len(TIME), 2))
    found = measure_swing(
        TIME, turned(both(0.2 * np.sin(phase), 0.1 * np.cos(phase))) + noise, at_rest=True
    )
    assert found.rms == pytest.approx((0.5 * (0.2**2 + 0.1**2)) ** 0.5, rel=0.25)
    assert found.period == pytest.approx(period, rel=0.05)
    assert found.regularity > 0.9


def test_gusts_and_noise_have_no_period():
    for _ in range(20):
        gusts = np.zeros((len(TIME), 2))
        for k in range(1, len(TIME)):
            gusts[k] = 0.995 * gusts[k - 1] + RANDOM.normal(0.0, 0.02, 2)
        assert measure_swing(TIME, gusts, at_rest=True).regularity < 0.7


def test_a_hover_of_4_s_is_judged_by_quicker_motion():
    roll = 0.2 * np.sin(2.0 * np.pi * TIME / 0.5)
    found = measure_swing(TIME[:1000], turned(both(roll, 0.0 * TIME))[:1000], at_rest=True)
    assert found.period == pytest.approx(0.5, rel=0.05)
    assert found.regularity > 0.9


def test_where_the_reference_moves_only_quick_motion_is_a_swing():
    slow, quick = (both(0.3 * np.sin(w * TIME), 0.3 * np.cos(w * TIME)) for w in (1.0, 9.0))
    assert measure_swing(TIME, turned(slow), at_rest=False).rms < 0.02
    assert measure_swing(TIME, turned(slow + quick), at_rest=False).regularity > 0.9


def test_slow_motion_is_no_swing():
    slow = both(0.3 * np.sin(2.0 * np.pi * TIME / 16.0), 0.02 * TIME)
    assert measure_swing(TIME, turned(slow), at_rest=True).rms < 0.02
    still = measure_swing(TIME, np.zeros((len(TIME), 2)), at_rest=True)
    assert (still.rms, isnan(still.period)) == (0.0, True)


@pytest.mark.parametrize(
    "time",
    [
        TIME[:700],
        TIME[::20],
        np.where(TIME < 74.0, TIME, TIME + 1e6),
        np.where(TIME < 74.0, TIME, TIME - 74.0),
        np.full(2000, 3.0),
        np.array([]),
    ],
    ids=["short", "sparse", "jump", "back", "stands", "none"],
)
def test_what_cannot_be_judged_is_not(time):
    assert isnan(measure_swing(time, np.ones((len(time), 2)), at_rest=True).rms)
