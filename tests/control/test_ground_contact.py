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
    "told",
    [{"height": 1.6}, {"height": -1.6}, {"sinks": 0.6}, {"sinks": -0.6}, {"landed": False}],
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
    assert not vehicle.tell(height=4.0, sinks=1.0).touched_down
    assert not vehicle.tell(height=3.5, sinks=1.0, after=0.6).touched_down
    assert not vehicle.tell(landed=False, height=3.0, sinks=1.0).touched_down
    assert not vehicle.tell(height=0.0).touched_down  # only just
    assert vehicle.tell(height=0.0, after=0.6).touched_down


def test_without_a_position_the_flag_alone_tells_a_landing():
    vehicle = Vehicle()
    vehicle.tell(landed=False, height=5.0, sinks=1.0)
    vehicle.state.landed = True
    for _ in range(3):
        vehicle.now += 0.4
        vehicle.ground.update()
    assert vehicle.ground.touched_down
