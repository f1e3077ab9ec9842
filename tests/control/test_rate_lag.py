"""Body rates behind a low pass: their lag is learned, and no heading is corrected because of it."""

from functools import cache
from math import cos, degrees, radians, sin

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from companion.attitude import BodyRates
from companion.control.estimator_resets import EstimatorResets
from companion.control.rate_lag import RateLag
from companion.vehicle.records import AttitudeSample

FINE = 0.0005
"""Step of the integrated attitude, s."""


def rates_at(time):
    """Body rates of the tumble, rad/s."""
    return np.array([2.0 * sin(9.0 * time), 2.0 * cos(7.0 * time), sin(3.0 * time)])


@cache
def tumble(seconds):
    """Time and attitude of each fine step."""
    time, rotation, way = 0.0, Rotation.identity(), []
    while time < seconds + 0.01:  # the last sample may come later
        rotation *= Rotation.from_rotvec(FINE * rates_at(time + 0.5 * FINE))
        time += FINE
        way.append((time, rotation))
    return way


def tumbled(lag, *, steps=(0.004, 0.008), seconds=4.0, noise=0.0, correction_deg_s=0.0):
    """The resets after a tumble whose rates are late; the attitude is integrated at 2000 Hz."""
    resets, random = EstimatorResets(), np.random.default_rng(1)
    way = iter(tumble(seconds))
    time, turn, history = 0.0, 0.0, []
    while time < seconds:
        step = steps[len(history) % len(steps)]
        for _ in range(round(step / FINE)):
            time, rotation = next(way)
        turn += radians(correction_deg_s) * step
        x, y, z, w = (Rotation.from_euler("z", turn) * rotation).as_quat()
        told = BodyRates(*(rates_at(time - lag) + random.normal(0.0, noise, 3)))
        resets.on_attitude(AttitudeSample(0, time, time, 0, (w, x, y, z), told))
        history.append(degrees(resets.heading_corrections))
    return resets, history


@pytest.mark.parametrize("lag", [0.0, 0.005, 0.011])
@pytest.mark.parametrize("steps", [(0.004,), (0.004, 0.008), (0.002, 0.003, 0.005, 0.005)])
def test_the_lag_is_learned_from_the_rotations(lag, steps):
    resets, _ = tumbled(lag, steps=steps, noise=0.002)
    assert resets.rate_lag.lag == pytest.approx(lag, abs=0.0005)


def test_late_rates_correct_no_heading_once_their_lag_is_known():
    """Without their lag they would do so by 1.4° in this tumble."""
    _, history = tumbled(0.011)
    learned = len(history) // 4
    assert np.ptp(history[learned:]) < 0.15


def test_corrections_of_the_heading_are_still_found_and_are_no_lag():
    resets, history = tumbled(0.005, correction_deg_s=2.0)
    assert resets.rate_lag.lag == pytest.approx(0.005, abs=0.001)
    assert history[-1] - history[len(history) // 4] == pytest.approx(6.0, abs=0.2)


@pytest.mark.parametrize("change", [(5.0, 0.0), (0.0, -5.0), (3.0, 4.0), (-4.0, 3.0)])
def test_a_change_of_the_rates_counts_by_its_size_about_whichever_axis(change):
    lag, learned = 0.004, RateLag()
    for _ in range(3):  # corrected by what is known already
        p, q = ((lag - learned.lag) * rate for rate in change)
        x, y, z, w = Rotation.from_rotvec((p, q, 0.1)).as_quat()
        learned.learn((0.0, 0.0, 0.0), (*change, 9.0), (1.0, 0.0, 0.0, 0.0), (w, x, y, z))
    assert learned.lag == pytest.approx(lag, rel=0.01)
