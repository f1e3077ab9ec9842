"""The learned drag, on a vehicle that circles in wind."""

import numpy as np
import pytest

from companion.guidance.drag_estimate import DragEstimate


def circled(true, configured, seconds=10.0, speed=3.0, wind=(2.0, -1.0), noise=0.4, seed=2):
    rng, estimate, dt = np.random.default_rng(seed), DragEstimate(configured), 1.0 / 30.0
    drags = []
    for n in range(round(seconds / dt)):
        v = speed * np.array([np.cos(n * dt), np.sin(n * dt)])
        left = true * (np.array(wind) - v) + noise * rng.normal(size=2)
        estimate.observe(dt, tuple(v), tuple(left))
        drags.append(estimate.drag)
    return np.array(drags)


@pytest.mark.parametrize("configured", [0.0, 0.5, 1.0, 1.5])
def test_in_a_circle_it_is_found_whatever_the_wind(configured):
    assert circled(1.0, configured)[-1] == pytest.approx(1.0, abs=0.04)


def test_it_says_whether_it_knows():
    estimate = DragEstimate(0.5)
    assert not estimate.certain
    for n in range(300):
        v = 3.0 * np.array([np.cos(n / 30), np.sin(n / 30)])
        estimate.observe(1 / 30, tuple(v), tuple(-v))
    assert estimate.certain
    assert DragEstimate(0.7).drag == 0.7


def test_a_hover_in_wind_teaches_nothing():
    drags = circled(1.0, 0.5, speed=0.0)
    assert drags == pytest.approx(np.full(len(drags), 0.5), abs=1e-9)


def test_noise_alone_moves_it_little():
    assert np.abs(circled(0.5, 0.5, speed=0.3, noise=0.6) - 0.5).max() <= 0.15


def test_it_follows_a_change_and_forgets():
    estimate = DragEstimate(0.5)
    for true in (0.5, 1.2):
        for n in range(30 * 90):
            v = 3.0 * np.array([np.cos(n / 30), np.sin(n / 30)])
            estimate.observe(1 / 30, tuple(v), tuple(-true * v))
    assert estimate.drag == pytest.approx(1.2, abs=0.02)


def test_it_is_never_negative_nor_beyond_belief():
    assert circled(-2.0, 0.3)[-1] == 0.0
    assert circled(50.0, 0.3)[-1] == pytest.approx(2.3)
