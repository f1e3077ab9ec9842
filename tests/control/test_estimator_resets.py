"""Estimator resets: unexplained jumps are found, and the vehicle does not follow them."""

from math import atan2, cos, radians, sin

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from companion.attitude import BodyRates, Target, coefficients, heading
from companion.control.estimator_resets import EstimatorResets
from companion.control.heading_frame import HeadingFrame
from companion.vehicle.records import AttitudeSample, LocalPosition
from tests.flight import tlog
from tests.flight.fly import fly, mock_vehicle


def quaternion(rotation):
    x, y, z, w = rotation.as_quat()
    return w, x, y, z


def turn(angle):
    return Rotation.from_euler("z", angle)


class Tumbling:
    """Attitudes of a body that turns quickly, by SciPy; with jumps about axes of the world."""

    def __init__(self, dt=0.01):
        self.resets, self.dt, self.time = EstimatorResets(), dt, 5.0
        self.rotation, self.rates = Rotation.from_euler("xy", (0.3, -0.4)), np.zeros(3)
        self.yaw_rate = 1.0

    def step(self, jump=None):
        rates = np.array([sin(9.0 * self.time), cos(7.0 * self.time), self.yaw_rate])
        self.rotation *= Rotation.from_rotvec(0.5 * self.dt * (self.rates + rates))
        self.rates, self.time = rates, self.time + self.dt
        if jump is not None:
            self.rotation = jump * self.rotation
        q = quaternion(self.rotation)
        sample = AttitudeSample(0, self.time, self.time, 0, q, BodyRates(*rates))
        return self.resets.on_attitude(sample)


@pytest.mark.parametrize("dt", [0.004, 0.02, 0.1])
def test_a_tumbling_vehicle_is_not_taken_for_a_jump(dt):
    body = Tumbling(dt)
    assert not any(body.step() for _ in range(100))
    assert (body.resets.frame.offset, list(body.resets.reset_times)) == (0.0, [])


def test_jumps_in_heading_add_up_the_short_way_and_the_attitude_goes_on_without_them():
    body = Tumbling()
    for angle in (1.8, 1.8, -0.3):
        body.step()
        assert not body.step(turn(angle))
        body.time += 1.0  # too long ago to compare with
        body.step()
    assert body.resets.frame.offset == pytest.approx(3.3 - 2 * np.pi, abs=0.01)
    assert len(body.resets.reset_times) == 3
    assert body.resets.largest_tilt_jump == 0.0
    before = turn(-body.resets.frame.offset) * body.rotation
    assert body.resets.frame.attitude(quaternion(body.rotation)) == pytest.approx(
        quaternion(before)
    )


def test_an_attitude_that_is_no_unit_quaternion_is_passed_over():
    body = Tumbling()
    body.step()
    before = body.resets.newest_attitude
    broken = AttitudeSample(0, 5.1, 5.1, 0, (0.0, 0.0, 0.0, 0.0), before.body_rates)
    assert body.resets.on_attitude(broken) is False
    assert body.resets.newest_attitude is before


@pytest.mark.parametrize("later", [0.0, -0.004, 0.11])
def test_attitudes_of_one_time_of_an_earlier_one_or_far_apart_tell_no_jump(later):
    body = Tumbling()
    body.step()
    newest = body.resets.newest_attitude
    turned = newest._replace(
        vehicle_time=newest.vehicle_time + later, q=quaternion(turn(1.0) * body.rotation)
    )
    assert body.resets.on_attitude(turned) is False
    assert (body.resets.frame.offset, list(body.resets.reset_times)) == (0.0, [])


def test_turns_about_the_z_axis_add_up_in_either_direction_and_jumps_do_not():
    """1 s at 1 rad/s, 1 s back: a gyro with a scale error is wrong by its share of both."""
    body = Tumbling()
    for yaw_rate in (1.0, -1.0):
        body.yaw_rate = yaw_rate
        for _ in range(100):
            body.step()
    assert body.resets.total_turn == pytest.approx(2.0, abs=0.03)
    assert body.resets.heading_corrections == pytest.approx(0.0, abs=0.01)
    before = body.resets.total_turn
    body.step(turn(0.5))
    assert body.resets.total_turn == before


def test_a_jump_of_the_thrust_axis_is_no_turn():
    body = Tumbling()
    body.step()
    assert body.step(Rotation.from_euler("x", 0.2))
    assert body.resets.frame.offset == 0.0
    assert body.resets.largest_tilt_jump == pytest.approx(0.2, abs=0.01)


def test_a_target_is_turned_with_the_attitude_so_that_they_differ_as_before():
    frame = HeadingFrame(0.4)
    tilted = turn(0.4) * Rotation.from_euler("zyx", (0.2, 0.1, -0.3))
    there = coefficients(quaternion(tilted))
    q = frame.attitude(quaternion(tilted))
    assert frame.target(Target(*there, 1.0))[:2] == pytest.approx(coefficients(q))
    assert heading(q) == pytest.approx(heading(quaternion(tilted)) - 0.4)


def test_positions_go_on_without_the_jumps():
    resets, dt = EstimatorResets(), 0.02
    for step in range(200):
        time = step * dt
        way = (sin(2.0 * time), 3.0 * time, -time)
        jump = 0.5 if step >= 100 else 0.0
        raw = (way[0] + jump, way[1], way[2] - jump)
        speed = (2.0 * cos(2.0 * time), 3.0, -1.0)
        shown = resets.position_without_jumps(LocalPosition(time, time, raw, speed))
        assert shown.position_ned == pytest.approx(way, abs=1e-3)
    assert resets.position_shift == pytest.approx((0.5, 0.0, -0.5), abs=1e-3)
    assert len(resets.reset_times) == 1


def test_the_counter_tells_of_resets_too_small_to_see_and_counts_none_twice():
    resets = EstimatorResets()
    for now, counter in ((1.0, 7), (2.0, 7), (3.0, 8), (3.2, 9), (5.0, 0)):
        resets.on_counter(counter, now)
    assert list(resets.reset_times) == [3.0, 5.0]


@pytest.mark.parametrize(
    ("dt", "change", "turned", "found"),
    [
        (0.1, 0.0, radians(3.9), False),
        (0.1, 0.0, radians(4.1), True),
        (0.1, 2.0, radians(4.0) + 0.09, False),
        (0.1, 2.0, radians(4.0) + 0.11, True),
        (0.05, 2.0, radians(4.0) + 0.06, True),
    ],
)
def test_a_jump_in_heading_is_4_degrees_and_half_of_what_the_rates_changed(
    dt, change, turned, found
):
    """The rates changed by `change` rad/s in between: they explain change·dt/2, either way."""
    resets = EstimatorResets()
    for time, angle, roll in ((5.0, 0.0, -0.5 * change), (5.0 + dt, turned, 0.5 * change)):
        q = quaternion(turn(angle))
        resets.on_attitude(AttitudeSample(0, time, time, 0, q, BodyRates(roll, 0.0, 0.0)))
    assert resets.frame.offset == pytest.approx(turned if found else 0.0)


@pytest.mark.parametrize(
    ("dt", "jump", "found"),
    [(0.02, 0.19, False), (0.02, 0.21, True), (0.4, 0.39, False), (0.4, 0.41, True)],
)
def test_a_jump_in_position_is_20_cm_and_what_a_change_of_acceleration_explains(dt, jump, found):
    """10 m/s² of change between two positions explain 10·dt²/8 m."""
    resets, speed = EstimatorResets(), (3.0, 0.0, 0.0)
    resets.position_without_jumps(LocalPosition(5.0, 5.0, (0.0, 0.0, 0.0), speed))
    resets.position_without_jumps(
        LocalPosition(5.0 + dt, 5.0 + dt, (3.0 * dt + jump, 0.0, 0.0), speed)
    )
    assert resets.position_shift == pytest.approx((jump if found else 0.0, 0.0, 0.0))


def flown(summary):
    """Positions (s, m NED) and headings (s, rad), as the autopilot estimated them."""
    positions, headings = [], []
    for m in tlog.messages(summary, "LOCAL_POSITION_NED", "ATTITUDE_QUATERNION"):
        if m.get_type() == "LOCAL_POSITION_NED":
            positions.append((m.time_boot_ms / 1e3, m.x, m.y, m.z))
        else:
            headings.append((m.time_boot_ms / 1e3, 2.0 * atan2(m.q4, m.q1)))
    return np.array(positions), np.array(headings)


def test_in_flight_the_vehicle_stays_where_it_is_when_its_estimate_jumps(tmp_path):
    jump, yaw = (0.3, -0.4, 0.0), 20.0
    reset = {"kind": "estimator_reset", "yaw_deg": yaw, "position_ned_m": jump}
    vehicle = {"lag_ms": 47.0, "dead_time_ms": 40.0, "yaw_lag_ms": 370.0, "yaw_dead_time_ms": 102.0}
    faults, wind = [{**reset, "after_offboard_s": 3.0}], {"speed_m_s": 3.0}
    # In other flights the heading wanders by up to 1.2° without a jump.
    with mock_vehicle(tmp_path, faults=faults, wind=wind, seed=2) as mock:
        summary = fly(mock, tmp_path / "log", vehicle=vehicle, hover={"duration_s": 5.0})
    assert summary.result == "ok", summary.events
    assert sum("the estimator was reset: 0.5 m and 20°" in text for _, text in summary.events) == 1
    positions, headings = flown(summary)
    at = int(np.argmax(np.linalg.norm(np.diff(positions[:, 1:], axis=0), axis=1)))
    when = positions[at, 0]
    truth = positions[:, 1:] - np.where(positions[:, :1] > when, jump, 0.0)
    near = (positions[:, 0] > when - 0.2) & (positions[:, 0] < when + 2.5)
    assert np.linalg.norm(truth[near] - truth[at], axis=1).max() < 0.15
    turned = headings[:, 1] - np.where(headings[:, 0] > when, radians(yaw), 0.0)
    turned = np.unwrap(turned)[(headings[:, 0] > when + 0.1) & (headings[:, 0] < when + 2.5)]
    assert np.ptp(turned) < radians(0.8)
    assert abs(turned[0] - headings[np.searchsorted(headings[:, 0], when) - 10, 1]) < radians(1.0)
