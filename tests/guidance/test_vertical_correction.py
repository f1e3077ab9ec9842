"""Height and vertical speed that contradict each other are corrected; a climb is left as it is."""

from math import cos, exp, sin

import numpy as np
import pytest

from companion.guidance.vertical_correction import VerticalCorrection, VerticalMotion

DT = 0.02


def corrected(height, speed, seconds, noise=0.0):
    """Times, corrected heights and corrected speeds of a motion; arrays of n."""
    correction, random = VerticalCorrection(), np.random.default_rng(2)
    times = np.arange(1, round(seconds / DT)) * DT
    rows = [
        correction.corrected(
            5.0 + t, VerticalMotion(height(t) + random.normal(0.0, noise), speed(t))
        )
        for t in times
    ]
    return times, *np.transpose(rows)


def test_a_speed_error_that_the_estimator_corrects_moves_the_height_no_more():
    """The height lags behind the measured one by the error of the speed times 1.2 s."""
    off, time_constant = 0.03, 1.2
    _, heights, _ = corrected(
        lambda t: -6.0 + off * time_constant * (1.0 - exp(-t / time_constant)), lambda t: off, 8.0
    )
    assert heights[-1] == pytest.approx(-6.0, abs=0.002)
    assert abs(heights + 6.0).max() < 0.016


def test_a_height_that_its_speed_explains_is_not_corrected():
    times, heights, _ = corrected(lambda t: sin(3.0 * t) / 3.0, lambda t: cos(3.0 * t), 20.0)
    assert heights == pytest.approx(np.sin(3.0 * times) / 3.0, abs=0.001)


def test_the_height_correction_is_limited_and_a_jump_is_none():
    _, heights, _ = corrected(lambda t: 0.0, lambda t: 2.0, 10.0)
    assert heights[-1] == pytest.approx(-0.1)
    times, heights, _ = corrected(lambda t: 3.0 if t > 5.0 else 0.0, lambda t: 0.0, 10.0)
    assert abs(heights - 3.0 * (times > 5.0)).max() < 0.03


def test_noise_of_the_height_is_not_amplified():
    _, heights, _ = corrected(lambda t: 0.0, lambda t: 0.0, 60.0, noise=0.01)
    assert np.std(heights) < 0.012


def test_a_constant_error_is_gone_after_seconds():
    times, _, speeds = corrected(lambda t: -6.0, lambda t: 0.03, 20.0)
    assert speeds[0] == pytest.approx(0.03)
    assert abs(speeds[times > 12.0]).max() < 0.002


def test_a_true_climb_is_not_taken_for_an_error():
    _, _, speeds = corrected(lambda t: -1.5 * t, lambda t: -1.5, 20.0)
    assert speeds == pytest.approx(-1.5, abs=1e-9)


def test_quick_motion_and_noisy_heights_pass_almost_unchanged():
    """The speed that is used for damping keeps its phase, and noise of 2 cm becomes 5 mm/s."""
    times, _, speeds = corrected(lambda t: sin(3.0 * t) / 3.0, lambda t: cos(3.0 * t), 20.0)
    assert speeds == pytest.approx(np.cos(3.0 * times), abs=0.02)
    _, _, speeds = corrected(lambda t: 0.0, lambda t: 0.0, 60.0, noise=0.02)
    assert np.std(speeds) < 0.005


def test_a_jump_of_the_height_does_not_become_a_climb():
    _, _, speeds = corrected(lambda t: 0.2 if t > 10.0 else 0.0, lambda t: 0.0, 30.0)
    assert abs(speeds).max() < 0.06
    assert abs(speeds[-1]) < 0.002


def test_what_is_learned_is_limited_and_survives_a_gap():
    correction = VerticalCorrection()
    for step in range(1000):
        motion = correction.corrected(5.0 + step * DT, VerticalMotion(0.0, 2.0))
    assert motion.speed == pytest.approx(1.85)
    assert correction.corrected(60.0, VerticalMotion(3.0, 2.0)).speed == pytest.approx(1.85)
