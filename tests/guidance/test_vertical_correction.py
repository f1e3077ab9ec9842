"""A vertical speed that the height does not follow is corrected; a climb is left as it is."""

from math import cos, sin

import numpy as np
import pytest

from companion.guidance.climb_bias import ClimbBias

DT = 0.02


def corrected(height, speed, seconds, noise=0.0):
    climb, random = ClimbBias(), np.random.default_rng(2)
    times = np.arange(1, round(seconds / DT)) * DT
    heights = [height(t) + random.normal(0.0, noise) for t in times]
    rows = [
        climb.corrected_speed(5.0 + t, h, speed(t)) for t, h in zip(times, heights, strict=True)
    ]
    return times, np.array(rows)


def test_a_constant_error_is_gone_after_seconds():
    times, speeds = corrected(lambda t: -6.0, lambda t: 0.03, 20.0)
    assert speeds[0] == pytest.approx(0.03)
    assert abs(speeds[times > 12.0]).max() < 0.002


def test_a_true_climb_is_not_taken_for_an_error():
    _, speeds = corrected(lambda t: -1.5 * t, lambda t: -1.5, 20.0)
    assert speeds == pytest.approx(-1.5, abs=1e-9)


def test_quick_motion_and_noisy_heights_pass_almost_unchanged():
    """The speed that is used for damping keeps its phase, and noise of 2 cm becomes 5 mm/s."""
    times, speeds = corrected(lambda t: sin(3.0 * t) / 3.0, lambda t: cos(3.0 * t), 20.0)
    assert speeds == pytest.approx(np.cos(3.0 * times), abs=0.02)
    _, speeds = corrected(lambda t: 0.0, lambda t: 0.0, 60.0, noise=0.02)
    assert np.std(speeds) < 0.005


def test_a_jump_of_the_height_does_not_become_a_climb():
    _, speeds = corrected(lambda t: 0.2 if t > 10.0 else 0.0, lambda t: 0.0, 30.0)
    assert abs(speeds).max() < 0.06
    assert abs(speeds[-1]) < 0.002


def test_what_is_learned_is_limited_and_survives_a_gap():
    climb = ClimbBias()
    for step in range(1000):
        climb.corrected_speed(5.0 + step * DT, 0.0, 2.0)
    assert climb.bias == 0.15
    assert climb.corrected_speed(60.0, 3.0, 2.0) == pytest.approx(1.85)
