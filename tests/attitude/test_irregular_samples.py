"""Samples as real autopilots send them cost `model-following` none of its straightness."""

from itertools import cycle
from math import radians

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from companion.attitude import BodyRates, Coefficients, Limits, Target, attitude, make_planner
from tests.attitude.independent import coefficients_of
from tests.attitude.lag_plant import LagPlant

HEADING = 0.3
STEPS = {
    "regular": [4],
    "PX4 at 190 Hz": [4, 4, 8, 4, 4, 8, 4, 8],
    "ArduPilot's pairs": [5, 5, 3, 2, 5, 5, 5, 2, 3],
    "a stall": [4] * 9 + [24],
}
"""ms between samples; a setpoint is held until the next one comes."""


def largest_cross_axis(steps_ms, tilt_rate):
    """Of figure 2's step, behind PX4's rate loop as it is told to the planner."""
    (w, x, y, z) = attitude(Coefficients(-0.4, -0.5), HEADING)
    plant = LagPlant(Rotation.from_quat([[x, y, z, w]]), (0.047, 0.047, 0.37), (0.04, 0.04, 0.102))
    limits = Limits(radians(45.0), radians(tilt_rate), radians(60.0))
    response = {"lag": 0.047, "dead_time": 0.04, "yaw_lag": 0.37, "yaw_dead_time": 0.102}
    planner = make_planner("model-following", limits=limits, **response)
    time, since, cross = 0.0, 0.004, 0.0
    for until_next in cycle((1e-3 * np.array(steps_ms)).tolist()):
        if time > 1.5:
            break
        x, y, z, w = plant.r.as_quat()[0].tolist()
        rates = BodyRates(*plant.true_rates[0].tolist())
        answer = planner.rates((w, x, y, z), Target(0.4, -0.5, HEADING), since, rates)
        plant.hold(np.array([answer]), until_next)
        time, since = time + until_next, until_next
        cross = max(cross, abs(coefficients_of(plant.r)[0][1] + 0.5))
    return cross


@pytest.mark.parametrize(
    ("steps", "bends"),
    [("regular", 1e-4), ("PX4 at 190 Hz", 1e-4), ("ArduPilot's pairs", 1e-4), ("a stall", 4e-3)],
)
def test_the_step_of_figure_2_stays_straight(steps, bends):
    """Without `SampleHold` PX4's samples bent it by 0.0009, a tenth of what it may bend there."""
    assert largest_cross_axis(STEPS[steps], 400.0) < bends
    assert largest_cross_axis(STEPS[steps], 90.0) < 0.3 * bends


def test_a_target_that_comes_with_a_late_sample_asks_for_no_spike():
    """The target did not apply before; twice the rates would saturate the motors."""
    planner = make_planner("model-following", 4.0, lag=0.047, dead_time=0.04)
    level, tilted = Target(0.0, 0.0, 0.0), Target(0.0, 0.4, 0.0)
    for _ in range(50):
        planner.rates((1.0, 0.0, 0.0, 0.0), level, 0.004)
    late = planner.rates((1.0, 0.0, 0.0, 0.0), tilted, 0.008)
    next_one = planner.rates((1.0, 0.0, 0.0, 0.0), tilted, 0.004)
    assert 0.9 * next_one.roll < late.roll < 1.01 * next_one.roll
