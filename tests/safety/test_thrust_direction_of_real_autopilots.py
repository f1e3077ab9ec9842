"""Circles at 5 m/s of a real PX4 and a real ArduCopter (in their simulators), and turned copies.

`recordings/circles.npz` has, by autopilot, 15 s from 3 s before the circle on: `attitude`, rows of
time (s) and quaternion at 50 Hz, and `velocity`, rows of time (s) and velocity (m/s NED).
"""

from math import degrees, radians
from pathlib import Path

import numpy as np
import pytest

from companion.attitude import BodyRates
from companion.attitude.rotation import turned_about_vertical
from companion.config import Config
from companion.control.outer_loop import motion_estimate
from companion.safety.thrust_direction import ThrustDirection
from companion.vehicle.records import AttitudeSample, LocalPosition

CIRCLES = np.load(Path(__file__).parent / "recordings" / "circles.npz")


def angles(autopilot, turn):
    """Time, s, and angle, degrees, wherever it is known; the attitude is turned by `turn` rad."""
    found, estimate = ThrustDirection(), motion_estimate(Config(), lambda: 0.0)
    estimate.on_acceleration = found.observe
    attitudes = iter(CIRCLES[f"{autopilot}_attitude"].tolist())
    known, (time, *q) = [], next(attitudes)
    for at, *velocity in CIRCLES[f"{autopilot}_velocity"].tolist():
        while time <= at:
            q_turned = turned_about_vertical(tuple(q), turn)
            estimate.note_attitude(
                AttitudeSample(0, time, time, 0, q_turned, BodyRates(0.0, 0.0, 0.0))
            )
            time, *q = next(attitudes, (float("inf"), 1.0, 0.0, 0.0, 0.0))
        position = LocalPosition(at, at, (0.0, 0.0, -5.0), tuple(velocity))
        estimate.note_position(position, offboard_active=True)
        if found.angle is not None:
            known.append((at, degrees(found.angle)))
    return known


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_real_autopilot_accelerates_where_its_thrust_points(autopilot):
    known = angles(autopilot, 0.0)
    assert len(known) > 300
    assert max(abs(angle) for _, angle in known) < 10.0


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
@pytest.mark.parametrize("turn", [90.0, -90.0, 180.0])
def test_with_a_turned_heading_it_does_not(autopilot, turn):
    known = angles(autopilot, radians(turn))
    wrong = [at for at, angle in known if abs(angle) > 50.0]
    assert wrong[0] < 6.0
    # In a steady circle one direction of the turn may be drag as well, so it does not stay wrong.
    assert len(wrong) > 50, "positions at 50 Hz: a second"
