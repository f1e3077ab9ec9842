"""The reference that follows from setpoints: jumps within limits, streams as they are."""

import math
import random

import numpy as np
import pytest

from companion.config import Config
from companion.config.files import changed
from companion.guidance.reference import VehicleMotion
from companion.serve.motion_settings import commanded_motion
from companion.serve.setpoints.approach import UnplannableError
from companion.serve.setpoints.motion import CommandedMotion, MotionLimits
from companion.serve.setpoints.request import AxisDemand, MotionRequest

SPEED, ACCELERATION, JERK, CLIMB, DESCENT, YAW_RATE, TIMEOUT = 5.0, 4.0, 12.0, 2.0, 1.0, 1.0, 0.5
LIMITS = MotionLimits(SPEED, ACCELERATION, JERK, CLIMB, DESCENT, YAW_RATE, TIMEOUT)
ORIGIN = (0.0, 0.0, 0.0)
STILL = VehicleMotion(ORIGIN, ORIGIN)


def begun(position=ORIGIN, velocity=ORIGIN, heading=0.0):
    motion = CommandedMotion(LIMITS)
    motion.begin(position, velocity, heading, 0.0)
    return motion


def request(position=None, velocity=None, acceleration=None, yaw=None, yaw_rate=None):
    def demand(axes):
        return AxisDemand(
            *(
                None if each is None else tuple(each[axis] for axis in axes)
                for each in (position, velocity, acceleration)
            )
        )

    return MotionRequest(demand((0, 1)), demand((2,)), yaw, yaw_rate)


def states(motion, begin, end, step=0.01):
    times = np.arange(begin, end, step)
    references = [motion.reference(time) for time in times]
    return (
        times,
        np.array([each.position_ned for each in references]),
        np.array([each.velocity_ned for each in references]),
        np.array([each.acceleration_ned for each in references]),
    )


def assert_within_limits(positions, velocities, accelerations, step=0.01, slack=1.04):
    assert np.linalg.norm(velocities[:, :2], axis=1).max() <= SPEED * slack + 1e-6
    assert np.linalg.norm(accelerations[:, :2], axis=1).max() <= ACCELERATION * slack + 1e-6
    jerk = np.diff(accelerations, axis=0) / step
    assert np.linalg.norm(jerk[:, :2], axis=1).max() <= JERK * slack + 1e-6
    assert velocities[:, 2].max() <= DESCENT + 1e-6
    assert velocities[:, 2].min() >= -CLIMB - 1e-6
    assert np.abs(np.diff(positions, axis=0) / step - velocities[:-1]).max() < 0.1


@pytest.mark.parametrize("angle", np.linspace(0.0, 2.0 * math.pi, 9))
def test_a_jump_of_the_position_becomes_a_straight_motion_within_limits(angle):
    motion = begun()
    goal = (30.0 * math.cos(angle), 30.0 * math.sin(angle), -6.0)
    motion.command(request(goal), 0.0, STILL)
    _, positions, velocities, accelerations = states(motion, 0.0, 20.0)
    assert_within_limits(positions, velocities, accelerations)
    assert positions[-1] == pytest.approx(goal, abs=1e-6)
    assert velocities[-1] == pytest.approx(ORIGIN, abs=1e-6)
    assert np.linalg.norm(velocities[:, :2], axis=1).max() == pytest.approx(SPEED, rel=0.01)
    across = -math.sin(angle) * positions[:, 0] + math.cos(angle) * positions[:, 1]
    assert np.abs(across).max() < 0.02


def test_the_same_setpoint_again_changes_nothing():
    once, often = begun(), begun()
    once.command(request((10.0, -5.0, -3.0)), 0.0, STILL)
    for number in range(100):
        often.command(request((10.0, -5.0, -3.0)), 0.05 * number, STILL)
    assert states(often, 5.0, 6.0)[1] == pytest.approx(states(once, 5.0, 6.0)[1], abs=1e-12)


def test_a_new_goal_on_the_way_turns_without_a_jump():
    motion = begun()
    rng = random.Random(1)
    rows, now = [], 0.0
    for _ in range(60):
        goal = tuple(rng.uniform(-20.0, 20.0) for _ in range(3))
        motion.command(request(goal), now, STILL)
        rows.append(states(motion, now, now + 0.6))
        now += 0.6
    positions, velocities, accelerations = (
        np.concatenate([row[kind] for row in rows]) for kind in (1, 2, 3)
    )
    assert np.abs(np.diff(velocities, axis=0)).max() < 0.01 * ACCELERATION * 1.6
    assert np.abs(np.diff(accelerations, axis=0)).max() < 0.01 * JERK * 1.5
    assert np.linalg.norm(np.diff(positions, axis=0), axis=1).max() < 0.01 * 1.5 * SPEED


def test_a_commanded_velocity_is_reached_within_limits_and_kept():
    motion = begun()
    motion.command(request(velocity=(3.0, -2.0, -1.0)), 0.0, STILL)
    _, positions, velocities, accelerations = states(motion, 0.0, 5.0)
    assert_within_limits(positions, velocities, accelerations)
    assert velocities[-1] == pytest.approx((3.0, -2.0, -1.0), abs=1e-9)
    assert accelerations[-1] == pytest.approx(ORIGIN, abs=1e-9)


def test_a_height_is_held_while_a_velocity_is_commanded():
    motion = begun((0.0, 0.0, -5.0))
    mixed = MotionRequest(AxisDemand(None, (2.0, 0.0), None), AxisDemand((-8.0,), None, None), 0, 0)
    motion.command(mixed, 0.0, VehicleMotion((0.0, 0.0, -5.0), ORIGIN))
    end = motion.reference(10.0)
    assert end.velocity_ned == pytest.approx((2.0, 0.0, 0.0), abs=1e-9)
    assert end.position_ned[2] == pytest.approx(-8.0)


def test_a_commanded_acceleration_is_flown_as_it_is():
    motion = begun(velocity=(1.0, 0.0, 0.0))
    motion.command(request(acceleration=(0.5, -0.25, 0.125)), 0.0, STILL)
    reference = motion.reference(0.4)
    assert reference.acceleration_ned == (0.5, -0.25, 0.125)


def circle(time, radius=5.0, speed=5.0):
    angle = speed * time / radius
    c, s = math.cos(angle), math.sin(angle)
    return (
        (radius * c, radius * s, -5.0),
        (-speed * s, speed * c, 0.0),
        (-(speed**2) / radius * c, -(speed**2) / radius * s, 0.0),
    )


@pytest.mark.parametrize("period", [0.01, 0.02, 0.05])
def test_a_stream_of_a_circle_is_flown_as_it_is(period):
    """The reference 0.1 s ahead, as guidance reads it, is that of the circle itself."""
    position, velocity, _ = circle(0.0)
    motion = begun(position, velocity)
    worst = [0.0, 0.0, 0.0]
    for number in range(round(4.0 / period)):
        now = number * period
        motion.command(request(*circle(now), yaw=0.3 * now), now, VehicleMotion(*circle(now)[:2]))
        for ahead in (0.0, 0.5 * period, 0.1) if now > 0.5 else ():
            reference = motion.reference(now + ahead)
            truth = circle(now + ahead)
            for kind, found in enumerate(
                (reference.position_ned, reference.velocity_ned, reference.acceleration_ned)
            ):
                worst[kind] = max(worst[kind], math.dist(found, truth[kind]))
            assert reference.heading == pytest.approx(0.3 * (now + ahead), abs=0.02)
    assert worst[0] < 2e-3
    assert worst[1] < 0.03
    assert worst[2] < 0.6


def test_a_stream_of_positions_and_velocities_has_its_acceleration_estimated():
    position, velocity, _ = circle(0.0)
    motion = begun(position, velocity)
    for number in range(100):
        now = 0.02 * number
        motion.command(request(*circle(now)[:2]), now, VehicleMotion(*circle(now)[:2]))
    found, truth = motion.reference(now + 0.05), circle(now + 0.05)
    assert math.dist(found.position_ned, truth[0]) < 0.02
    assert math.dist(found.acceleration_ned, truth[2]) < 0.6


def test_a_stream_that_begins_elsewhere_is_joined_within_limits():
    motion = begun()
    rows = []
    for number in range(400):
        now = 0.02 * number
        position, velocity, acceleration = circle(now, radius=10.0, speed=2.0)
        motion.command(request(position, velocity, acceleration), now, STILL)
        rows.append(motion.reference(now))
    velocities = np.array([row.velocity_ned for row in rows])
    positions = np.array([row.position_ned for row in rows])
    assert np.linalg.norm(velocities[:, :2], axis=1).max() < 1.05 * (SPEED + 2.0)
    assert np.linalg.norm(np.diff(positions, axis=0), axis=1).max() < 0.02 * (SPEED + 4.0)
    assert math.dist(rows[-1].position_ned, circle(now, 10.0, 2.0)[0]) < 1e-6


@pytest.mark.parametrize(
    ("velocity", "acceleration", "axis", "most"),
    [
        ((5.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0, 2.0 + 5.0 * TIMEOUT + 5.0**2 / ACCELERATION + 2.0),
        ((0.0, 0.0, 0.0), (0.0, 2.0, 0.0), 1, 5.0),  # the first point of a circle
    ],
)
def test_a_setpoint_that_is_repeated_for_ever_stops_at_its_position(
    velocity, acceleration, axis, most
):
    """MAVSDK repeats the last setpoint of a program that hangs: position, velocity and all."""
    motion = begun()
    frozen = request((2.0, 0.0, 0.0), velocity, acceleration)
    furthest = 0.0
    for number in range(200):
        now = 0.05 * number
        motion.command(frozen, now, STILL)
        furthest = max(furthest, abs(motion.reference(now).position_ned[axis]))
    end = motion.reference(now)
    assert end.position_ned == pytest.approx((2.0, 0.0, 0.0), abs=1e-3)
    assert end.velocity_ned == pytest.approx(ORIGIN, abs=1e-3)
    assert furthest < most


def test_stopping_comes_to_rest_within_limits():
    motion = begun(velocity=(4.0, 0.0, -1.0))
    motion.command(request(velocity=(4.0, 0.0, -1.0)), 0.0, STILL)
    motion.stop(1.0, VehicleMotion((4.0, 0.0, -1.0), (4.0, 0.0, -1.0)))
    _, positions, velocities, accelerations = states(motion, 1.0, 6.0)
    assert_within_limits(positions, velocities, accelerations)
    assert velocities[-1] == pytest.approx(ORIGIN, abs=1e-9)


@pytest.mark.parametrize(("start", "yaw"), [(0.0, 3.0), (3.0, -3.0), (-3.0, 3.0), (9.0, 0.0)])
def test_a_yaw_is_turned_to_the_short_way_at_a_limited_rate(start, yaw):
    motion = begun(heading=start)
    motion.command(request(ORIGIN, yaw=yaw), 0.0, STILL)
    headings = [motion.reference(0.01 * number).heading for number in range(800)]
    rates = np.diff(headings) / 0.01
    assert np.abs(rates).max() <= YAW_RATE + 1e-6
    assert math.cos(headings[-1] - yaw) == pytest.approx(1.0)
    assert abs(headings[-1] - start) <= math.pi + 1e-9


def test_a_yaw_rate_turns_and_no_yaw_holds_the_heading():
    motion = begun(heading=1.0)
    motion.command(request(ORIGIN, yaw_rate=0.5), 0.0, STILL)
    assert motion.reference(4.0).heading_rate == pytest.approx(0.5)
    motion.command(request(ORIGIN), 4.0, STILL)
    assert motion.reference(8.0).heading_rate == pytest.approx(0.0)
    assert motion.reference(8.0).heading == pytest.approx(motion.reference(7.0).heading)


@pytest.mark.parametrize("change", [0.0, 1e-6])
def test_without_a_position_the_reference_does_not_run_away_from_the_vehicle(change):
    """A vehicle that is blown back is not chased by an error that grows without bound."""
    motion = begun()
    for number in range(400):
        now = 0.05 * number
        motion.command(request(velocity=(3.0 + change * number, 0.0, 0.0)), now, STILL)
    assert motion.reference(now).position_ned[0] < 2.0


@pytest.mark.parametrize(("down", "flown"), [(9.0, DESCENT), (-9.0, -CLIMB), (0.5, 0.5)])
def test_a_commanded_climb_is_limited_as_guidance_limits_it(down, flown):
    motion = begun()
    motion.command(request(velocity=(0.0, 0.0, down)), 0.0, STILL)
    _, _, velocities, _ = states(motion, 0.0, 5.0)
    assert velocities[-1, 2] == pytest.approx(flown)
    assert np.abs(velocities[:, 2]).max() < abs(flown) + 1e-6


@pytest.mark.parametrize("velocity", [None, 0.5])
@pytest.mark.parametrize(("down", "limit"), [(90.0, DESCENT), (-90.0, -CLIMB)])
def test_a_vertical_acceleration_does_not_lead_beyond_the_vertical_limits(down, limit, velocity):
    """A vehicle that follows it at once fell at four times limits.max_descent_m_s."""
    motion, vehicle, fastest = begun(), STILL, 0.0
    sideways = (0.0, 0.0)
    for number in range(150):
        now = 0.02 * number
        commanded = None if velocity is None else (*sideways, math.copysign(velocity, down))
        changing = request(velocity=commanded, acceleration=(*sideways, down + 1e-3 * number))
        motion.command(changing, now, vehicle)
        reference = motion.reference(now + 0.01)
        assert abs(reference.acceleration_ned[2]) <= 6.0
        speed = vehicle.velocity_ned[2] + 0.02 * reference.acceleration_ned[2]
        vehicle = VehicleMotion(reference.position_ned, (*sideways, speed))
        fastest = max(fastest, speed / limit, reference.velocity_ned[2] / limit)
    assert fastest < (1.05 if velocity is None else 1.5)
    assert velocity is not None or fastest > 0.9
    braking = request(acceleration=(*sideways, -0.5 * math.copysign(1.0, down)))
    motion.command(braking, now, vehicle)
    assert motion.reference(now).acceleration_ned[2] * down < 0.0, "it may always be slowed down"


def test_an_acceleration_beside_a_repeated_velocity_ends_with_the_timeout():
    motion, moving = begun(), VehicleMotion(ORIGIN, (3.0, 0.0, 0.0))
    frozen = request(velocity=(3.0, 0.0, 0.0), acceleration=(2.0, 0.0, 0.0))
    for number in range(200):
        motion.command(frozen, 0.05 * number, moving)
    assert motion.reference(10.0).velocity_ned == pytest.approx((3.0, 0.0, 0.0), abs=1e-6)


def test_a_reference_that_ran_away_from_the_vehicle_is_not_chased_when_the_client_is_silent():
    motion = begun()
    rising = request(acceleration=(90.0, 0.0, 0.0))
    for number in range(100):
        motion.command(rising, 0.02 * number, STILL)
        assert motion.reference(0.02 * number).velocity_ned[0] < 5.0
    for number in range(100):
        fast = 30.0 * 0.02 * number
        motion.command(request((fast, 0.0, 0.0), (30.0, 0.0, 0.0)), 2.0 + 0.02 * number, STILL)
    motion.stop(4.0, STILL)
    _, positions, *_ = states(motion, 4.0, 8.0)
    assert np.abs(positions).max() < 1e-6


def test_a_request_without_a_motion_changes_nothing():
    motion = begun()
    motion.command(request((1.0, 2.0, -3.0)), 0.0, STILL)
    before = [motion.reference(0.5 * number) for number in range(20)]
    wild = MotionRequest(
        AxisDemand((9.0, 9.0), None, None), AxisDemand((math.nan,), None, None), None, None
    )
    with pytest.raises(UnplannableError):
        motion.command(wild, 0.0, STILL)
    assert [motion.reference(0.5 * number) for number in range(20)] == before


def test_any_sequence_of_requests_gives_finite_references():
    rng = random.Random(7)
    motion = begun()
    for number in range(3000):
        now = 0.02 * number

        def some(size, maybe=0.5):
            return None if rng.random() < maybe else [rng.uniform(-size, size) for _ in range(3)]

        position, velocity = some(50.0), some(10.0)
        acceleration = some(8.0) if position is None or velocity else None
        if position is velocity is acceleration is None:
            velocity = [0.0, 0.0, 0.0]
        yaw = rng.choice((None, rng.uniform(-6.0, 6.0)))
        rate = rng.choice((None, rng.uniform(-3.0, 3.0)))
        motion.command(request(position, velocity, acceleration, yaw, rate), now, STILL)
        reference = motion.reference(now + rng.random())
        values = (*reference.position_ned, *reference.velocity_ned, *reference.acceleration_ned)
        assert all(map(math.isfinite, (*values, reference.heading, reference.heading_rate)))


def test_a_commanded_velocity_beyond_the_monitor_s_limit_is_slowed_and_keeps_its_direction():
    config = changed(Config(), {"safety": {"max_speed_m_s": 10.0}}, "the test")
    motion = commanded_motion(config)
    motion.begin(ORIGIN, ORIGIN, 0.0, 0.0)
    motion.command(request(velocity=(24.0, 18.0, -9.0)), 0.0, STILL)
    north, east, down = motion.reference(60.0).velocity_ned
    assert math.hypot(north, east, down) == pytest.approx(9.0, abs=0.05)
    assert math.atan2(east, north) == pytest.approx(math.atan2(18.0, 24.0))
