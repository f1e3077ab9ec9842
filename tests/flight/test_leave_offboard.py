"""A vehicle is not left disarmed in offboard, where PX4 never is ready to be armed again."""

import asyncio
from contextlib import nullcontext
from types import SimpleNamespace

import pytest

from companion.flight.control_phases import _require_landing
from companion.flight.leave_offboard import leave_offboard
from companion.mavlink.errors import CommandRefused
from companion.safety.actions import Exit, FlightEnded
from companion.vehicle.ardupilot.autopilot import ArduPilot
from companion.vehicle.autopilot import Role
from companion.vehicle.px4.autopilot import Px4
from tests.flight.fly import fly, mock_vehicle
from tests.flight.others import When

HOLD_ASKED = (
    "the vehicle is disarmed in OFFBOARD, in which it cannot be armed again: asking the autopilot "
    "to hold"
)


def test_after_a_failsafe_landing_the_next_flight_begins():
    with mock_vehicle(parameters={"COM_OBL_RC_ACT": 4}) as mock:
        cut = {"kind": "drop", "duration_s": 3.0}
        observer = When("maneuvers", lambda: mock.inject(cut), after=1.0)
        first = fly(mock, None, observer)
        assert "nothing is commanded" in first.events[-1][1]
        left = mock.until(lambda state: not state["armed"])
        assert (left["mode"], left["crashed"]) == ("OFFBOARD", False)
        second = fly(mock, hover={"duration_s": 0.5})
    assert second.result == "ok", second.events
    assert HOLD_ASKED in [text for _, text in second.events]


class Vehicle:
    """In one mode, until it obeys or somebody else changes that."""

    def __init__(self, mode, *, armed=False, meanwhile=lambda _: None, refuses=False):
        self.mode, self.is_armed, self.meanwhile, self.refuses = mode, armed, meanwhile, refuses
        self.sent, self.notes, self.waiting_for = 0, [], ""
        self.mode_by_failsafe = self.mode_not_intended = False
        self.link = self.autopilot = self.state = self
        self.note = self.notes.append
        self.replacement_detector = SimpleNamespace(require=lambda: None)

    mode_received_at = 0.0

    def subscribe(self, *_):
        return lambda: None

    def armed(self):
        return self.is_armed

    def roles(self, mode):
        return frozenset({mode})

    def hold(self):
        return (176, 1.0, 4.0, 3.0)

    async def fresh_heartbeat(self):
        self.meanwhile(self)

    async def until(self, condition):
        while not condition():  # noqa: ASYNC110
            await asyncio.sleep(0.001)

    async def command(self, *_, retries):
        self.sent += 1
        if self.refuses:
            raise CommandRefused("DO_SET_MODE", 1, "TEMPORARILY_REJECTED", ())
        self.mode = Role.HOLD


def test_it_is_asked_once_and_said_so():
    vehicle = Vehicle(Role.OFFBOARD)
    asyncio.run(leave_offboard(vehicle))
    assert (vehicle.mode, vehicle.sent, len(vehicle.notes)) == (Role.HOLD, 1, 1)


@pytest.mark.parametrize(
    "vehicle",
    [Vehicle(Role.HOLD), Vehicle(Role.LAND), Vehicle(Role.OFFBOARD, armed=True)],
    ids=["hold", "land", "armed"],
)
def test_nothing_is_asked_of_any_other_vehicle(vehicle):
    asyncio.run(leave_offboard(vehicle))
    assert (vehicle.sent, vehicle.notes) == (0, [])


def test_a_vehicle_that_was_told_to_land_on_the_ground_is_asked_to_hold_before_a_flight():
    """A real PX4 stays in AUTO.LAND then, and its pre-arm checks fail until another mode."""
    vehicle = Vehicle(Role.LAND)
    asyncio.run(leave_offboard(vehicle, Px4.cannot_arm_in))
    assert (vehicle.mode, vehicle.sent, len(vehicle.notes)) == (Role.HOLD, 1, 1)
    assert not ArduPilot.cannot_arm_in  # it is armed in GUIDED, wherever it stood


@pytest.mark.parametrize("change", [{"mode": Role.READY}, {"is_armed": True}])
def test_who_changed_its_mode_or_armed_it_meanwhile_is_not_overruled(change):
    vehicle = Vehicle(Role.OFFBOARD, meanwhile=lambda self: vars(self).update(change))
    with pytest.raises(FlightEnded) as ended:
        asyncio.run(leave_offboard(vehicle))
    assert (ended.value.exit, vehicle.sent) == (Exit.RELEASE, 0)


def test_a_refusal_says_what_to_do():
    with pytest.raises(FlightEnded, match="command another mode") as ended:
        asyncio.run(leave_offboard(Vehicle(Role.OFFBOARD, refuses=True)))
    assert ended.value.exit is Exit.LEAVE


@pytest.mark.parametrize(("by_heartbeat", "ends"), [(False, False), (True, True)])
def test_a_landing_that_ended_in_offboard_is_not_taken_for_a_takeover(by_heartbeat, ends):
    """PX4 tells of OFFBOARD by CURRENT_MODE before a heartbeat tells that it disarmed."""
    vehicle = Vehicle(Role.OFFBOARD, armed=True)
    vehicle.heartbeat_is_newest = by_heartbeat
    with pytest.raises(FlightEnded) if ends else nullcontext():
        _require_landing(vehicle)
