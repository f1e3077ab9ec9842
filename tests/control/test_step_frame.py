"""Open-loop steps keep their line while the estimator corrects its heading."""

from math import degrees, exp, radians

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from companion.attitude import BodyRates, Limits, Target, attitude, coefficients, heading
from companion.attitude.rotation import turned_about_vertical
from companion.attitude.types import Coefficients
from companion.control.estimator_resets import EstimatorResets
from companion.control.guidance_command import GuidanceCommand
from companion.control.planner_runner import PlannerRunner
from companion.vehicle.records import AttitudeSample, AttitudeTarget

DT = 0.004
STILL = BodyRates(0.0, 0.0, 0.0)
TRUE = attitude(Coefficients(0.3, 0.4), 0.2)
TARGET = Target(0.4, 0.5, 0.2)


class Seeing:
    """A planner that keeps what it is shown."""

    def reset(self, q, body_rates=None):
        pass

    def rates(self, q, target, dt, body_rates=None):
        self.q, self.target = q, target
        return STILL

    def note_attitude_target(self, q, age):
        pass


class Vehicle:
    """It hangs still, and its estimator's heading error changes."""

    def __init__(self):
        self.resets, self.planner = EstimatorResets(), Seeing()
        self.runner = PlannerRunner(self.planner, self.resets, Limits(0.6, 1.5, 1.0))
        self.error, self.time, self.body_rates = 0.0, 5.0, STILL

    def fly(self, seconds, rate_deg_s=0.0, *, is_step, dt=DT):
        for _ in range(round(seconds / dt)):
            self.error += radians(rate_deg_s) * dt
            self.time += dt
            q, ms = self.estimated(), round(1e3 * self.time)
            sample = AttitudeSample(ms, self.time, self.time, 0, q, self.body_rates)
            self.resets.on_attitude(sample)
            command = GuidanceCommand(TARGET, 0.0, self.time, is_step=is_step)
            self.move(self.runner.rates(sample, command, dt), dt)
        return self.planner

    def estimated(self):
        return turned_about_vertical(TRUE, self.error)

    def move(self, rates, dt):
        self.sent = rates


def test_a_corrected_heading_does_not_turn_the_line_of_a_step():
    vehicle = Vehicle()
    vehicle.fly(2.0, 0.3, is_step=False)
    before = vehicle.fly(DT, is_step=True).q
    seen = vehicle.fly(0.5, -2.6, is_step=True)
    assert seen.q == pytest.approx(before, abs=1e-9)
    assert seen.target is TARGET
    assert vehicle.sent == STILL  # this autopilot's rates are about the vehicle's own axes


def test_it_follows_at_most_three_degrees_and_does_not_trust_samples_far_apart():
    vehicle = Vehicle()
    vehicle.fly(DT, is_step=True)
    seen = vehicle.fly(2.0, 4.0, is_step=True)
    assert heading(seen.q) == pytest.approx(0.2 + radians(5.0), abs=1e-3)
    rare = Vehicle()
    rare.fly(0.03, is_step=True, dt=0.03)
    seen = rare.fly(0.9, 2.0, is_step=True, dt=0.03)
    assert heading(seen.q) == pytest.approx(0.2 + radians(1.8), abs=1e-6)


def test_after_steps_the_turn_decays_and_guidance_gets_the_acceleration_it_asked_for():
    vehicle = Vehicle()
    vehicle.fly(DT, is_step=True)
    vehicle.fly(0.5, 4.0, is_step=True)
    seen = vehicle.fly(DT, is_step=False)
    turn = heading(vehicle.resets.frame.attitude(turned_about_vertical(TRUE, vehicle.error)))
    turn -= heading(seen.q)
    assert turn == pytest.approx(radians(2.0), abs=1e-3)
    # The horizontal target is turned as the attitude is: the acceleration is what guidance asked.
    goal = turned_about_vertical(attitude(seen.target[:2], seen.target.heading), turn)
    assert coefficients(goal) == pytest.approx((0.4, 0.5), abs=1e-9)
    assert seen.target.heading == TARGET.heading  # it does not jump when a step begins or ends
    later = vehicle.fly(4.0, is_step=False)
    left = 0.2 + vehicle.error - heading(later.q)
    assert left == pytest.approx(turn * exp(-2.0), rel=0.01)


def test_a_new_step_begins_where_the_old_ones_left_the_frame():
    vehicle = Vehicle()
    vehicle.fly(DT, is_step=True)
    vehicle.fly(0.5, 4.0, is_step=True)
    before = vehicle.fly(0.5, is_step=False).q
    assert vehicle.fly(DT, is_step=True).q == pytest.approx(before, abs=1e-4)


class TargetFollower(Vehicle):
    """Its autopilot takes rates along an attitude target in the frame of its estimator.

    As ArduPilot: rates are fed forward, and the attitude follows the target at 4.5 1/s.
    """

    def __init__(self):
        super().__init__()
        self.body = self.target = Rotation.from_quat(TRUE, scalar_first=True)
        self.runner.attitude_target = self.attitude_target

    def estimated(self):
        estimated = Rotation.from_rotvec([0.0, 0.0, self.error]) * self.body
        return tuple(estimated.as_quat(scalar_first=True))

    def attitude_target(self):
        q = tuple(self.target.as_quat(scalar_first=True))
        return AttitudeTarget(round(1e3 * self.time), q)

    def move(self, rates, dt):
        estimated = Rotation.from_quat(self.estimated(), scalar_first=True)
        turning = np.array(rates) + 4.5 * (estimated.inv() * self.target).as_rotvec()
        self.body_rates = BodyRates(*turning)
        self.body *= Rotation.from_rotvec(turning * dt)
        self.target *= Rotation.from_rotvec(np.array(rates) * dt)


def test_a_vehicle_that_follows_its_estimator_keeps_its_attitude_in_steps():
    """A correction of 1.3° within half a second, as ArduPilot's in the first step, and the rest."""
    vehicle = TargetFollower()
    before = vehicle.body
    vehicle.fly(0.1, is_step=True)
    farthest = 0.0
    for _ in range(50):
        vehicle.fly(0.01, -2.6, is_step=True)
        farthest = max(farthest, (vehicle.body.inv() * before).magnitude())
    vehicle.fly(2.0, is_step=True)
    assert degrees(farthest) < 0.1
    assert degrees((vehicle.body.inv() * before).magnitude()) < 0.1
