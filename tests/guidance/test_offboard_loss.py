"""How far the last rates carry a vehicle: by hand where that can be, and its limits."""

from math import cos, hypot, inf, pi, sin

import pytest

from companion.drag import NO_DRAG, Drag
from companion.guidance import GRAVITY
from companion.guidance.fence import Fence
from companion.guidance.offboard_loss import LossFailsafe, MotionAtLoss, path_thrust, reach

LEVEL, NOTHING = (0.0, 0.0, -GRAVITY), (0.0, 0.0, 0.0)
FENCE = Fence(50.0, 30.0, 1.0, (), (), 2.5, 0.3)
PX4 = LossFailsafe(1.0, brakes=True, drag=NO_DRAG, max_tilt_rate=pi, fence=FENCE)
ARDUPILOT = PX4._replace(brakes=False)


def flown(velocity=NOTHING, thrust=LEVEL, turn=NOTHING):
    return MotionAtLoss(NOTHING, velocity, thrust, turn)


def test_a_vehicle_that_hovers_is_carried_no_farther_than_feedback_had_turned_it():
    there = reach(flown(), PX4._replace(hold_time=0.0))
    assert there.largest_distance < 0.1
    assert max(there.max_climb, there.max_fall) < 0.1
    assert hypot(*there.stop_position) == 0.0
    assert reach(flown(), PX4).largest_distance < 2.0


def test_level_at_a_speed_it_goes_on_for_the_time_and_then_brakes_as_the_fence_reckons():
    """A fraction over, for feedback."""
    there = reach(flown(velocity=(5.0, 0.0, 0.0)), PX4)
    assert there.stop_position == pytest.approx(
        (5.0 * 1.1 + FENCE.stopping_point(NOTHING, (5.0, 0.0, 0.0))[0], 0.0)
    )
    assert there.largest_distance == pytest.approx(there.stop_position[0] + there.stop_radius)
    assert 0.0 < there.stop_radius < 5.0


def test_without_feedback_height_and_drift_are_what_one_reckons_by_hand():
    """The failsafe begins 0.1 s after the rates were held, and levels a level vehicle in 0.1 s."""
    steady = PX4._replace(max_tilt_rate=0.0)
    climbing = reach(flown(velocity=(0.0, 0.0, -3.0)), steady)
    assert climbing.max_climb == pytest.approx(3.0 * 1.1 + 3.0 * 0.1 + 3.0**2 / 8.0)
    assert climbing.max_fall == 0.0
    falling = reach(flown(velocity=(0.0, 0.0, 3.0)), steady)
    assert falling.max_fall == pytest.approx(3.0 * 1.1 + 3.0 * 0.1 + 3.0**2 / 8.0)
    assert falling.max_climb == 0.0
    drifting = reach(flown(velocity=(-5.0, 0.0, 0.0)), steady._replace(brakes=False))
    assert drifting.stop_position == pytest.approx((-5.0 * 1.1 - 5.0 * 0.1 - 5.0 / 0.2, 0.0))
    assert drifting.stop_radius == pytest.approx(0.0, abs=1e-9)


def test_a_tilted_vehicle_falls_by_the_thrust_it_lacks_until_it_is_level():
    """By hand, for a tilt of 1 rad: held for 0.1 s, levelled from 0.1 s later on at 3 rad/s."""
    tilted = flown(thrust=(GRAVITY * sin(1.0), 0.0, -GRAVITY * cos(1.0)))
    there = reach(tilted, PX4._replace(hold_time=0.0, max_tilt_rate=0.0))
    lacking, until_level = GRAVITY * (1.0 - cos(1.0)), 0.1 + 1.0 / 3.0
    levelling = GRAVITY * (1.0 - sin(1.0))  # the mean of cos from 1 rad to 0 is sin(1)/1
    speed = lacking * 0.1
    fall = 0.5 * lacking * 0.1**2 + speed * until_level + 0.5 * levelling * until_level**2
    braking = (speed + levelling * until_level) ** 2 / 8.0
    assert there.max_fall == pytest.approx(fall + braking, rel=0.01)
    assert there.max_climb == 0.0


def test_the_spread_is_that_of_a_thrust_axis_that_feedback_turns_all_the_time():
    """By hand: at 0.15 rad/s the acceleration is g·0.15·t, the speed half of that by t."""
    there = reach(flown(), PX4)
    time = 1.1
    moved, speed = GRAVITY * 0.15 * time**3 / 6.0, GRAVITY * 0.15 * time**2 / 2.0
    assert there.max_climb == pytest.approx(moved + speed * 0.1 + speed**2 / 8.0, rel=0.06)
    until_level = 0.1 + 0.15 * time / 3.0
    assert there.max_fall == pytest.approx(moved + speed * until_level + speed**2 / 8.0, rel=0.06)


def test_an_autopilot_that_does_not_hold_lets_it_drift_until_drag_has_stopped_it():
    east = flown(velocity=(0.0, 5.0, 0.0))
    slippery, dragged = (
        reach(east, ARDUPILOT._replace(drag=drag)) for drag in (NO_DRAG, Drag(0.5))
    )
    assert (
        slippery.stop_position[1] > 5.5 + 5.0 / 0.2
    )  # unknown drag: the least that any vehicle has
    assert 5.0 / 0.5 < dragged.stop_position[1] < 0.6 * slippery.stop_position[1]


def test_rates_that_are_held_turn_the_thrust_and_the_longer_the_worse():
    rolling = flown(turn=(0.5 * GRAVITY, 0.0, 0.0))  # 0.5 rad/s northwards from level
    short, long = (reach(rolling, PX4._replace(hold_time=held)) for held in (0.5, 1.5))
    assert 0.0 < short.stop_position[0] < long.stop_position[0] / 5.0
    assert short.max_fall < long.max_fall
    slower = reach(rolling, PX4._replace(hold_time=1.5, max_tilt_rate=0.2))
    assert slower.stop_position[0] < 0.5 * long.stop_position[0]
    assert slower.max_fall < long.max_fall


def test_a_tilted_vehicle_that_turns_through_level_climbs_by_its_surplus_of_thrust():
    tilted = path_thrust((5.0, 0.0, 0.0), NOTHING, NO_DRAG)
    back = (-5.0, 0.0, 0.0)
    surplus = hypot(5.0, GRAVITY) - GRAVITY
    there = reach(flown(thrust=tilted, turn=back), PX4)
    assert 0.1 < there.max_climb < 2.0 * surplus  # which it has for some of a second
    assert there.max_climb > reach(flown(), PX4).max_climb


def test_upside_down_it_falls_for_as_long_as_it_takes_to_level():
    fast = flown(turn=(3.0 * GRAVITY, 0.0, 0.0))
    there = reach(fast, PX4)
    fallen = 0.5 * GRAVITY * (1.0 - cos(1.5)) * 1.0
    assert there.max_fall > fallen
    assert reach(fast, PX4._replace(max_tilt_rate=1.5)).max_fall < 0.5 * there.max_fall


@pytest.mark.parametrize("thrust", [LEVEL, NOTHING])
@pytest.mark.parametrize("drag", [Drag(10.0), Drag(1.0, 1.0)])
def test_however_strong_the_drag_and_long_the_hold_it_only_slows(drag, thrust):
    """A step of the integration is longer than the drag's time constant; thrust may be nothing."""
    failsafe = ARDUPILOT._replace(hold_time=10.0, drag=drag)
    there = reach(flown(velocity=(20.0, 0.0, 0.0), thrust=thrust, turn=(0.0, 0.0, 1.0)), failsafe)
    assert 0.0 < there.stop_position[0] < 20.0 * 10.1
    assert 0.0 <= there.stop_radius < inf
    assert 0.0 <= there.max_fall < 3000.0  # it falls without thrust for 12 s


def test_drag_is_part_of_the_thrust_that_a_path_takes():
    assert path_thrust((1.0, 0.0, -0.5), (2.0, -3.0, 1.0), Drag(0.5)) == pytest.approx(
        (2.0, -1.5, -0.5 - GRAVITY)
    )
