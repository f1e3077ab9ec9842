"""Which phases a flight has, by the family that it meets; and which modes each of them allows."""

import pytest

from companion.config.flight import FlightConfig
from companion.flight.commands import require_role, roles_of
from companion.flight.phases import EXIT_PHASES, flight_phases, ground_phases
from companion.safety.actions import Exit, FlightEnded
from companion.vehicle.autopilot import Role
from companion.vehicle.registry import AUTOPILOTS, autopilot_for

QUADROTOR = 2
PX4, ARDUPILOT = autopilot_for(12, QUADROTOR), autopilot_for(3, QUADROTOR)
FROM_ARMING = ["arm", "takeoff", "offboard", "maneuvers", "hand back", "land", "disarm"]


class Vehicle:
    """As much of a link as tells a mode."""

    def __init__(self, autopilot, base_mode, custom_mode):
        self.autopilot, self.state = autopilot, self
        self.mode = autopilot.mode_name(base_mode, custom_mode)
        self.mode_by_failsafe = self.mode_not_intended = False


def phases(autopilot):
    return {phase.name: phase for phase in flight_phases(FlightConfig(), 10.0, autopilot)}


def test_setpoints_stream_before_arming_only_where_a_command_takes_over():
    """On ArduPilot the first setpoint takes over, and would end the take-off."""
    assert [phase.name for phase in ground_phases(FlightConfig())] == ["connect", "checks"]
    assert list(phases(PX4)) == ["stream", *FROM_ARMING]
    assert list(phases(ARDUPILOT)) == FROM_ARMING


@pytest.mark.parametrize(
    ("autopilot", "phase", "base_mode", "custom_mode", "ours"),
    [
        (PX4, "maneuvers", 129, 0x00060000, True),
        (PX4, "maneuvers", 157, 0x00030000, False),
        (PX4, "takeoff", 157, 0x02040000, True),
        (PX4, "land", 157, 0x14040000, True),  # DESCEND: our landing goes on without a position
        (PX4, "maneuvers", 157, 0x14040000, False),
        (ARDUPILOT, "takeoff", 217, 4, True),
        (ARDUPILOT, "takeoff", 209, 4, False),  # somebody else's rates are obeyed
        (ARDUPILOT, "takeoff", 217, 17, False),  # BRAKE is no end of a climb
        (ARDUPILOT, "offboard", 217, 17, False),
        (ARDUPILOT, "offboard", 217, 4, True),
        (ARDUPILOT, "offboard", 209, 4, True),
        (ARDUPILOT, "maneuvers", 209, 4, True),
        (ARDUPILOT, "maneuvers", 217, 4, False),  # it holds: our rates are not obeyed any more
        (ARDUPILOT, "maneuvers", 209, 0, False),
        (ARDUPILOT, "maneuvers", 217, 5, False),
        (ARDUPILOT, "hand back", 217, 17, True),
        (ARDUPILOT, "land", 217, 9, True),
        (ARDUPILOT, "land", 217, 6, False),
    ],
)
def test_a_mode_that_is_not_the_phases_own_lets_the_vehicle_go(
    autopilot, phase, base_mode, custom_mode, ours
):
    vehicle = Vehicle(autopilot, base_mode, custom_mode)
    allowed = phases(autopilot)[phase].allowed_roles
    if ours:
        require_role(vehicle, allowed)
        return
    with pytest.raises(FlightEnded, match="took over") as ended:
        require_role(vehicle, allowed)
    assert ended.value.exit is Exit.RELEASE


@pytest.mark.parametrize("autopilot", AUTOPILOTS, ids=lambda autopilot: autopilot.name)
def test_every_role_is_played_by_a_mode_that_the_family_enters(autopilot):
    played = {
        role
        for base_mode in (128, 128 | 8)
        for number in autopilot.modes.values()
        for role in autopilot.roles(autopilot.mode_name(base_mode, number))
    }
    assert played == set(Role)


def test_an_unknown_mode_plays_no_role():
    vehicle = Vehicle(PX4, 157, 0x05040000)
    assert roles_of(vehicle) == frozenset()
    vehicle.mode = None
    assert roles_of(vehicle) == frozenset()


def test_each_exit_ends_on_the_ground_or_in_other_hands():
    assert set(EXIT_PHASES) == set(Exit)
    for phases in EXIT_PHASES.values():
        names = [phase.name for phase in phases]
        assert names in ([], ["disarm"], ["hand back"], ["listen"], ["land", "disarm"])
