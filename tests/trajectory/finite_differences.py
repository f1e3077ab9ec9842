"""Derivatives of a trajectory judged by differences of what they are derivatives of."""

import numpy as np

STEP = 1e-5
"""s."""

_PAIRS = (("position", "velocity"), ("velocity", "acceleration"), ("acceleration", "jerk"))


def _slope(samples, quantity):
    """Five-point differences of (m,) samples at −2, −1, 1 and 2 steps."""
    far_behind, behind, ahead, far_ahead = (
        np.array([getattr(s, quantity) for s in samples[k]]) for k in (-2, -1, 1, 2)
    )
    return (8.0 * (ahead - behind) - (far_ahead - far_behind)) / (12.0 * STEP)


def assert_derivatives_agree(trajectory, times, jumps=0.0):
    """Position to jerk, and heading to its rate, at times further than 2·STEP from the ends.

    `jumps` is the smallest jump that the jerk makes; where it makes one, it is not compared.
    """
    samples = {k: [trajectory.at(t + k * STEP) for t in times] for k in range(-2, 3)}
    turned = np.subtract(*([s.jerk for s in samples[k]] for k in (2, -2)))
    jumped = (np.linalg.norm(turned, axis=1) > 0.5 * jumps) & (jumps > 0.0)
    assert jumped.mean() < 0.2
    for integral, derivative in _PAIRS:
        given = np.array([getattr(s, derivative) for s in samples[0]])
        wrong = np.linalg.norm(_slope(samples, integral) - given, axis=1)
        if derivative == "jerk":
            wrong = wrong[~jumped]
        assert wrong.max() < 2e-5 * (1.0 + np.abs(given).max()), derivative
    rates = np.array([s.heading_rate for s in samples[0]])
    wrong = np.abs(_slope(samples, "heading") - rates)
    assert wrong.max() < 2e-5 * (1.0 + np.abs(rates).max())


def inner_times(trajectory, count=101):
    """Times all over the trajectory, none of them special."""
    return np.linspace(3.7 * STEP, trajectory.duration - 4.1 * STEP, count)


def evenly(trajectory, step):
    """Times from the beginning to the end, at most `step` seconds apart."""
    count = int(np.ceil(trajectory.duration / step)) + 1
    return np.linspace(0.0, trajectory.duration, count).tolist()


def assert_rests_at_both_ends(trajectory):
    """Begins at (0, 0, 0) at rest, and rests at its end for ever."""
    end = trajectory.at(trajectory.duration).position
    for time, place in (
        (-1.0, (0.0, 0.0, 0.0)),
        (0.0, (0.0, 0.0, 0.0)),
        (trajectory.duration, end),
        (trajectory.duration + 5.0, end),
    ):
        sample = trajectory.at(time)
        np.testing.assert_allclose(sample.position, place, atol=1e-9)
        for rest in (sample.velocity, sample.acceleration):
            np.testing.assert_allclose(rest, (0.0, 0.0, 0.0), atol=1e-7)
        assert abs(sample.heading_rate) < 1e-7


def largest(trajectory, *derivatives, count=20_001):
    """Largest length of each derivative, one number if there is one."""
    samples = [trajectory.at(t) for t in np.linspace(0.0, trajectory.duration, count).tolist()]
    lengths = [
        np.linalg.norm([getattr(sample, each) for sample in samples], axis=1).max()
        for each in derivatives
    ]
    return lengths if len(lengths) > 1 else lengths[0]
