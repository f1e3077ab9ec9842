"""`model-following` on an autopilot that takes the rates along an attitude target, as ArduPilot."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from companion.attitude import BodyRates, Target, make_planner
from tests.attitude.independent import attitudes, coefficients_of
from tests.attitude.simulate import quaternion

START, GOAL, HEADING = np.array([-0.4, -0.5]), np.array([0.4, -0.5]), 0.7
LAG, YAW_LAG = 0.02, 0.12


class TargetFrame:
    """The target turns by lagged tilt rates and the yaw rate as commanded; the body lags in yaw.

    The body is the target turned back by δ about its z axis, δ̇ = ω_z,commanded − r, where r, the
    body's own yaw rate, follows the command with the lag of yaw.
    """

    def __init__(self, start):
        self._target, self._tilt = start, np.zeros(2)
        self._behind = self._yaw = 0.0

    @property
    def body(self):
        return self._target * Rotation.from_rotvec([0.0, 0.0, -self._behind])

    @property
    def body_rates(self):
        cosine, sine = np.cos(self._behind), np.sin(self._behind)
        x, y = self._tilt
        return BodyRates(cosine * x - sine * y, sine * x + cosine * y, self._yaw)

    def hold(self, command, seconds, steps=8):
        h = seconds / steps
        for _ in range(steps):
            self._tilt = command[:2] + (self._tilt - command[:2]) * np.exp(-h / LAG)
            self._yaw = command[2] + (self._yaw - command[2]) * np.exp(-h / YAW_LAG)
            self._target = self._target * Rotation.from_rotvec([*(self._tilt * h), command[2] * h])
            self._behind += (command[2] - self._yaw) * h


def cross_track(turn, **options):
    planner = make_planner("model-following", 5.0, lag=LAG, yaw_lag=YAW_LAG, **options)
    plant, off = TargetFrame(attitudes(START, HEADING)[0]), []
    for _ in range(375):
        rates = planner.rates(
            quaternion(plant.body), Target(*GOAL, HEADING + turn), 0.004, plant.body_rates
        )
        plant.hold(np.array(rates), 0.004)
        off.append(coefficients_of(plant.body)[1] + 0.5)
    return np.abs(off).max()


def test_the_plants_body_turns_as_it_says():
    plant = TargetFrame(attitudes(START, HEADING)[0])
    plant.hold(np.array([0.5, -0.8, 0.6]), 0.1, 200)
    before, rates = plant.body, np.array(plant.body_rates)
    plant.hold(np.array([0.5, -0.8, 0.6]), 1e-4, 1)
    assert (before.inv() * plant.body).as_rotvec() / 1e-4 == pytest.approx(rates, abs=2e-2)


@pytest.mark.parametrize("turn", [0.0, 1.5])
def test_the_lead_of_the_frame_keeps_the_line_straight(turn):
    assert cross_track(turn, frame_lead=YAW_LAG) <= 3e-4
    assert cross_track(turn) >= 0.01  # it is worth something
