"""Sources of references: maneuvers, and what another program commands one by one."""

import pytest

from companion.attitude import Coefficients
from companion.guidance import ManeuverSequence, Pose, Reference, VehicleMotion
from companion.guidance.maneuvers import Corners
from companion.guidance.reference import HorizontalMode, TiltCommand, VerticalMode
from companion.guidance.source import CommandedSource, ManeuverSource, extrapolated_reference

POSE = Pose((1.0, 2.0, -3.0), 0.5)
HERE = VehicleMotion((4.0, 5.0, -6.0), (1.0, 0.0, 0.0))
FIRST = Reference((1.0, 2.0, -3.0), (1.0, 0.0, 0.0), heading=0.25)


def commanded():
    """A source that has begun at 10 s: the first reference within 2 s, then each 0.5 s."""
    source = CommandedSource("the program", 0.5, 2.0)
    source.begin(10.0, POSE)
    return source


def at(source, now):
    return source.reference(now, HERE)(now)


def test_maneuvers_count_from_their_beginning():
    corners = Corners(0.4, 0.5, 1.0, 2.0)
    sequence = ManeuverSequence([corners])
    source = ManeuverSource(sequence)
    assert (source.name, source.failure, source.finished(99.0)) == (corners.name, None, False)
    assert source.pose is None
    with pytest.raises(RuntimeError, match="not begun"):
        source.reference(10.0, HERE)
    source.begin(10.0, POSE)
    assert source.reference(10.0, HERE)(11.5) == sequence.at(1.5, POSE)
    end = 10.0 + sequence.duration
    assert (source.finished(end - 0.01), source.finished(end)) == (False, True)


def test_an_empty_sequence_is_not_flown():
    with pytest.raises(ValueError, match="has no maneuvers"):
        ManeuverSequence(()).at(0.0, POSE)


def test_the_pose_is_held_until_the_first_reference():
    source = commanded()
    assert (source.name, source.pose, source.finished(10.0)) == ("the program", POSE, False)
    assert at(source, 12.0) == Reference(POSE.position_ned, heading=0.5)
    assert source.failure is None
    at(source, 12.01)
    assert source.failure == "the program gave no new command for 2 s"
    source.give(FIRST, 12.02)
    assert at(source, 12.02) == Reference(POSE.position_ned, heading=0.5)


def test_a_source_without_a_pose_holds_where_the_vehicle_is():
    source = CommandedSource("the program", 0.5, 2.0)
    assert at(source, 1.0) == Reference(HERE.position_ned)
    at(source, 2.5)
    assert source.failure is not None


def test_a_reference_moves_on_until_it_is_too_old_and_then_the_place_is_held():
    source = commanded()
    source.give(FIRST, 11.0)
    assert at(source, 11.5).position_ned == (1.5, 2.0, -3.0)
    assert source.failure is None
    held = at(source, 11.51)
    assert held == Reference(HERE.position_ned, heading=0.25)
    assert source.failure == "the program gave no new command for 0.5 s"
    source.give(FIRST, 11.52)
    elsewhere = VehicleMotion((9.0, 9.0, -9.0), (0.0, 0.0, 0.0))
    assert source.reference(11.6, elsewhere)(11.6) is held


def test_a_program_may_end_or_fail():
    source = commanded()
    source.give(FIRST, 11.0)
    source.end()
    assert source.finished(11.0)
    assert at(source, 20.0).position_ned == (10.0, 2.0, -3.0)  # its last one stays in force
    assert source.failure is None
    source.fail("it crashed")
    assert source.failure == "it crashed"
    assert at(source, 20.0) == Reference(HERE.position_ned, heading=0.25)


def accelerating(north):
    return FIRST._replace(acceleration_ned=(north, 0.0, 0.0))


def jerk(source, now):
    """The jerk north, from how the acceleration changes in 0.1 s."""
    reference_at = source.reference(now, HERE)
    change = reference_at(now + 0.1).acceleration_ned[0] - reference_at(now).acceleration_ned[0]
    return change / 0.1


def test_the_jerk_is_told_or_follows_from_the_reference_before():
    source = commanded()
    source.give(accelerating(0.0), 11.0, (2.0, 0.0, 0.0))
    assert jerk(source, 11.0) == pytest.approx(2.0)
    source.give(accelerating(1.0), 11.1)
    assert jerk(source, 11.1) == 0.0  # nothing to compare with: the one before told its own
    source.give(accelerating(1.3), 11.2)
    assert jerk(source, 11.2) == pytest.approx(3.0)
    source.give(accelerating(1.4), 11.2 + 1e-4)  # a moment later tells nothing
    assert jerk(source, 11.2 + 1e-4) == pytest.approx(3.0)
    source.give(accelerating(9.0), 11.3)  # 77 m/s³ is a step
    assert jerk(source, 11.3) == 0.0


@pytest.mark.parametrize(
    "other",
    [
        FIRST._replace(horizontal=HorizontalMode.ACCELERATION),
        FIRST._replace(vertical=VerticalMode.ACCELERATION),
        FIRST._replace(horizontal=TiltCommand(Coefficients(0.1, 0.0))),
    ],
)
def test_another_kind_of_reference_has_no_jerk(other):
    source = commanded()
    source.give(accelerating(1.0), 11.0)
    source.give(other._replace(acceleration_ned=(1.2, 0.0, 0.0)), 11.1)
    assert jerk(source, 11.1) == 0.0
    source.give(accelerating(1.0), 11.2)
    source.give(accelerating(1.2), 11.3)
    assert jerk(source, 11.3) == pytest.approx(2.0)
    source.give(other, 11.3 + 1e-4)
    assert jerk(source, 11.3 + 1e-4) == 0.0


def test_a_reference_goes_on_with_its_velocity_acceleration_jerk_and_heading_rate():
    start = Reference(
        (1.0, 2.0, 3.0), (4.0, 5.0, 6.0), (0.5, 1.0, 1.5), heading=0.5, heading_rate=0.25
    )
    later = extrapolated_reference(start, (3.0, 6.0, 9.0), 3.0)
    assert later.position_ned == pytest.approx((28.75, 48.5, 68.25))
    assert later.velocity_ned == pytest.approx((19.0, 35.0, 51.0))
    assert later.acceleration_ned == pytest.approx((9.5, 19.0, 28.5))
    assert (later.heading, later.heading_rate) == (1.25, 0.25)
