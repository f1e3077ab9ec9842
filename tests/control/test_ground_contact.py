"""Ground contact is judged by more than the autopilot's flag."""

from types import SimpleNamespace

import pytest

from companion.control.ground_contact import GroundContact
from companion.vehicle.records import LocalPosition


class Vehicle:
    """Telemetry of a vehicle, with a clock set by hand."""

    def __init__(self):
        self.now = 10.0
        self.state = SimpleNamespace(landed=True, flying=False, height=0.0, position=None)
        self.ground = GroundContact(self.state, lambda: self.now)
        self.tell()

    def tell(self, *, landed=True, height=0.0, sinks=0.0, after=0.02):
        self.now += after
        position = LocalPosition(self.now, self.now, (0.0, 0.0, -height), (0.0, 0.0, sinks))
        self.state.landed, self.state.flying = landed, not landed
        self.state.height, self.state.position = height, position
        self.ground.update()
        return self.ground


def test_standing_it_may_idle():
    ground = Vehicle().tell()
    assert ground.standing
    assert ground.may_idle


@pytest.mark.parametrize(
    "told", [{"height": 1.6}, {"height": -1.6}, {"sinks": 0.6}, {"sinks": -0.6}, {"landed": False}]
)
def test_a_flag_that_height_or_speed_contradict_makes_no_idle_setpoint(told):
    assert not Vehicle().tell(**told).may_idle


def test_once_a_takeoff_was_commanded_nothing_idles_any_more():
    vehicle = Vehicle()
    vehicle.ground.command_takeoff()
    assert vehicle.tell().standing  # it still stands, and may be disarmed
    assert not vehicle.ground.may_idle
    vehicle.tell(landed=False, height=2.0)
    assert not vehicle.tell(height=0.0).may_idle


@pytest.mark.parametrize(
    "lifted", [{"landed": False}, {"height": 1.1}], ids=["by its flag", "by its height"]
)
def test_what_left_the_ground_does_not_stand_because_a_flag_says_so(lifted):
    vehicle = Vehicle()
    vehicle.ground.command_takeoff()
    vehicle.tell(**lifted)
    assert not vehicle.tell(landed=True).standing


def test_a_takeoff_that_was_refused_leaves_it_standing():
    vehicle = Vehicle()
    vehicle.ground.command_takeoff()
    assert vehicle.tell(height=0.3, sinks=-0.2).standing


def test_it_touched_down_when_the_flag_lasts_and_nothing_sinks():
    vehicle = Vehicle()
    vehicle.tell(landed=False, height=5.0, sinks=1.0)
    assert not vehicle.tell(height=4.0, sinks=1.0).has_touched_down
    assert not vehicle.tell(height=3.5, sinks=1.0, after=0.6).has_touched_down
    assert not vehicle.tell(landed=False, height=3.0, sinks=1.0).has_touched_down
    assert not vehicle.tell(height=0.0).has_touched_down  # only just
    assert vehicle.tell(height=0.0, after=0.6).has_touched_down


def test_without_a_position_the_flag_alone_tells_a_landing():
    vehicle = Vehicle()
    vehicle.tell(landed=False, height=5.0, sinks=1.0)
    vehicle.state.landed = True
    for _ in range(3):
        vehicle.now += 0.4
        vehicle.ground.update()
    assert vehicle.ground.has_touched_down


@pytest.mark.parametrize(
    ("height", "idles"), [(1.5, True), (-1.5, True), (1.51, False)], ids=["at it", "below", "over"]
)
def test_the_height_of_the_ground_is_allowed(height, idles):
    assert Vehicle().tell(height=height).may_idle is idles


def test_half_a_metre_a_second_is_too_quick_for_the_ground():
    assert not Vehicle().tell(sinks=0.5).may_idle
    assert Vehicle().tell(sinks=0.49).may_idle


def test_it_has_lifted_off_once_it_is_a_metre_higher_than_at_the_command():
    vehicle = Vehicle()
    vehicle.tell(height=1.0)
    vehicle.ground.command_takeoff()
    for height in (1.5, 2.0):
        assert vehicle.tell(height=height).standing
    vehicle.tell(height=2.25)
    assert not vehicle.tell(height=1.0).standing


def test_one_sign_is_enough_to_have_lifted_off():
    vehicle = Vehicle()
    assert not vehicle.tell(sinks=-1.0).has_lifted_off, "nothing was commanded: the estimate drifts"
    vehicle.ground.command_takeoff()
    assert not vehicle.tell(sinks=-0.4).has_lifted_off
    assert vehicle.tell(sinks=-0.6).has_lifted_off
    assert not vehicle.tell(sinks=0.0).has_lifted_off
    assert vehicle.tell(height=2.0).has_lifted_off
    assert vehicle.tell(height=0.0).has_lifted_off, "it has been in the air"


def test_a_vertical_speed_lasts_half_a_second():
    vehicle = Vehicle()
    vehicle.tell(sinks=1.0)
    vehicle.now = vehicle.state.position.received + 0.5
    assert not vehicle.ground.may_idle
    vehicle.now += 0.01
    assert vehicle.ground.may_idle


def test_a_vehicle_that_already_flew_neither_stands_nor_idles():
    vehicle = Vehicle()
    assert (vehicle.ground.takeoff_commanded, vehicle.ground.has_touched_down) == (False, False)
    vehicle.ground.note_flying()
    assert vehicle.ground.takeoff_commanded is True
    assert not vehicle.tell().standing
